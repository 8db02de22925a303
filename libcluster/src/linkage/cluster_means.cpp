// SPDX-License-Identifier: Apache-2.0
#include "linkage/cluster_means.hpp"

namespace terrace::cluster {
namespace {

/// Returns the factor of a squared distance in Ward's method: 2 |a| |b| / (|a| + |b|). Symmetric to
/// the last bit.
double ward_factor(double a, double b) { return 2.0 * a * b / (a + b); }

/// Subtracts the least coordinate of an axis if that is exact for all points. Without it, means of
/// points far from the origin would lose digits.
void move_to_origin(std::vector<double>& axis) {
  if (axis.empty()) return;
  const double low = *std::min_element(axis.begin(), axis.end());
  std::vector<double> shifted(axis.size());
  for (std::size_t i = 0; i < axis.size(); ++i) {
    const double difference = axis[i] - low;
    // The rounding error of the difference (D. Knuth).
    const double restored = axis[i] - difference;
    if ((axis[i] - (difference + restored)) + (restored - low) != 0.0) return;
    shifted[i] = difference;
  }
  axis = std::move(shifted);
}

}  // namespace

ClusterMeans::ClusterMeans(const LinkagePoints& points, LinkageMethod method,
                           const LinkageOptions& options)
    : ClusterSlots(points.scaled().size(), options.check_stop),
      linkage_points_(points),
      method_(method),
      kernels_(linkage_kernels<double>(options.path)),
      row_(points.scaled().size()) {
  for (unsigned a = 0; a < 3; ++a) {
    axis_[a].reserve(size());
    for (const Point3& p : points.scaled()) axis_[a].push_back(p[a]);
    move_to_origin(axis_[a]);
  }
}

double ClusterMeans::distance(std::uint32_t a, std::uint32_t b) const {
  const double square = squared_distance({axis_[0][a], axis_[1][a], axis_[2][a]},
                                         {axis_[0][b], axis_[1][b], axis_[2][b]});
  return method_ == LinkageMethod::ward ? square * ward_factor(points(b), points(a)) : square;
}

NearCluster ClusterMeans::nearest(std::uint32_t x, std::uint32_t begin, std::uint32_t end,
                                  NearCluster best) {
  if (begin >= end) return best;
  const std::size_t count = end - begin;
  kernels_.distances(axis_[0].data() + begin, axis_[1].data() + begin, axis_[2].data() + begin,
                     count, axis_[0][x], axis_[1][x], axis_[2][x], row_.data());
  if (method_ == LinkageMethod::ward) {
    // Dead slots become NaN, which is never nearer than anything.
    const double own_points = points(x);
    const double* const others = points() + begin;
    for (std::size_t k = 0; k < count; ++k) row_[k] *= ward_factor(others[k], own_points);
  }
  if (x >= begin && x < end) row_[x - begin] = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < count; ++k) {
    if (row_[k] < best.distance) best = {row_[k], begin + static_cast<std::uint32_t>(k)};
  }
  return best;
}

void ClusterMeans::join(std::uint32_t low, std::uint32_t high, double /*between*/) {
  const bool middle = method_ == LinkageMethod::median;
  const double a = middle ? 1.0 : points(low), b = middle ? 1.0 : points(high);
  for (std::vector<double>& axis : axis_) {
    // Equal coordinates stay exactly equal.
    axis[high] = axis[low] == axis[high] ? axis[high] : (a * axis[low] + b * axis[high]) / (a + b);
    axis[low] = std::numeric_limits<double>::infinity();
  }
}

void ClusterMeans::move(const std::vector<std::uint32_t>& slots) {
  for (std::vector<double>& axis : axis_) {
    for (std::size_t k = 0; k < slots.size(); ++k) axis[k] = axis[slots[k]];
    axis.resize(slots.size());
  }
}

}  // namespace terrace::cluster
