// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <terrace/base/box.hpp>
#include <terrace/base/portable_math.hpp>

#include "delaunay2/double_kernel.hpp"
#include "terrace/tri/point_tin.hpp"

namespace terrace::tri {
namespace {

using planar::DoubleKernel;
using Corners = std::array<std::uint32_t, 3>;

/// A raster over the surface. Every cell lists the triangles that overlap it.
class Raster {
 public:
  Raster(std::span<const Point3> vertices, std::span<const Corners> triangles)
      : vertices_(vertices), triangles_(triangles) {
    for (const Corners& corners : triangles)
      for (const std::uint32_t v : corners)
        box_.include(base::Point2{vertices[v][0], vertices[v][1]});
    const double per_axis = std::sqrt(static_cast<double>(triangles.size()));
    side_ = static_cast<std::size_t>(std::clamp(per_axis, 1.0, 4096.0));
    start_.assign(side_ * side_ + 1, 0);
    for (const Corners& corners : triangles)
      for_cells(corners, [&](std::size_t cell) { ++start_[cell]; });
    std::size_t sum = 0;
    for (std::size_t& start : start_) start = sum += start;
    entries_.resize(sum);
    for (std::size_t t = triangles.size(); t-- > 0;)
      for_cells(triangles[t], [&](std::size_t cell) {
        entries_[--start_[cell]] = static_cast<std::uint32_t>(t);
      });
  }

  /// A triangle that contains the place, or nullptr.
  [[nodiscard]] const Corners* find(double x, double y) const {
    if (!box_.contains({x, y})) return nullptr;
    const std::size_t cell = cell_of(y, 1) * side_ + cell_of(x, 0);
    for (std::size_t e = start_[cell]; e < start_[cell + 1]; ++e) {
      const Corners& corners = triangles_[entries_[e]];
      const auto place = [&](std::size_t i) {
        const Point3& v = vertices_[corners[i]];
        return std::array<double, 2>{v[0], v[1]};
      };
      if (DoubleKernel::orientation(place(0), place(1), {x, y}) >= 0 &&
          DoubleKernel::orientation(place(1), place(2), {x, y}) >= 0 &&
          DoubleKernel::orientation(place(2), place(0), {x, y}) >= 0)
        return &corners;
    }
    return nullptr;
  }

 private:
  /// Monotone, so that a place between two others is in a cell between theirs.
  [[nodiscard]] std::size_t cell_of(double c, std::size_t axis) const {
    const double part = (c - box_.min[axis]) / (box_.max[axis] - box_.min[axis]);
    const double cell = part * static_cast<double>(side_);
    return cell > 0 ? std::min(static_cast<std::size_t>(cell), side_ - 1) : 0;
  }

  template <class Visit>
  void for_cells(const Corners& corners, Visit visit) const {
    std::array<std::size_t, 2> first{side_, side_};
    std::array<std::size_t, 2> last{0, 0};
    for (const std::uint32_t v : corners) {
      for (std::size_t k = 0; k < 2; ++k) {
        first[k] = std::min(first[k], cell_of(vertices_[v][k], k));
        last[k] = std::max(last[k], cell_of(vertices_[v][k], k));
      }
    }
    for (std::size_t row = first[1]; row <= last[1]; ++row) {
      const auto [from, to] = columns_in(corners, row);
      for (std::size_t column = std::max(from, first[0]); column <= std::min(to, last[0]); ++column)
        visit(row * side_ + column);
    }
  }

  /// The columns that a triangle covers in a row of cells, slightly too many.
  [[nodiscard]] std::array<std::size_t, 2> columns_in(const Corners& corners,
                                                      std::size_t row) const {
    // Uses a band slightly wider than the row.
    const double height = (box_.max[1] - box_.min[1]) / static_cast<double>(side_);
    const double bottom = box_.min[1] + (static_cast<double>(row) - 0.01) * height;
    const double top = bottom + 1.02 * height;
    double left = HUGE_VAL;
    double right = -HUGE_VAL;
    for (std::size_t i = 0; i < 3; ++i) {
      const Point3& a = vertices_[corners[i]];
      const Point3& b = vertices_[corners[(i + 1) % 3]];
      if (std::max(a[1], b[1]) < bottom || std::min(a[1], b[1]) > top) continue;
      const auto x_at = [&](double y) {
        const double part = b[1] == a[1] ? 0 : std::clamp((y - a[1]) / (b[1] - a[1]), 0.0, 1.0);
        return a[0] + part * (b[0] - a[0]);
      };
      for (const double x : {x_at(bottom), x_at(top)}) {
        left = std::min(left, x);
        right = std::max(right, x);
      }
      // Level edges.
      if (a[1] == b[1]) right = std::max(right, b[0]), left = std::min(left, b[0]);
    }
    if (left > right) return {1, 0};
    const double margin = 1e-9 * (box_.max[0] - box_.min[0]);
    return {cell_of(left - margin, 0), cell_of(right + margin, 0)};
  }

  std::span<const Point3> vertices_;
  std::span<const Corners> triangles_;
  base::Box2 box_;
  std::size_t side_;
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> entries_;
};

/// Uses the areas of the three parts, in long double. The formula differs from the mesher's on
/// purpose.
double height_at(const Point3& a, const Point3& b, const Point3& c, double x, double y) {
  using Long = long double;
  const auto part = [x, y](const Point3& p, const Point3& q) {
    const Long area = (Long{p[0]} - x) * (Long{q[1]} - y) - (Long{p[1]} - y) * (Long{q[0]} - x);
    return area > 0 ? area : Long{0};
  };
  const Long wa = part(b, c);
  const Long wb = part(c, a);
  const Long wc = part(a, b);
  const Long sum = wa + wb + wc;
  if (sum > 0) return static_cast<double>((wa * a[2] + wb * b[2] + wc * c[2]) / sum);
  const auto distance = [x, y](const Point3& p) { return base::hypot(p[0] - x, p[1] - y); };
  if (distance(a) <= distance(b) && distance(a) <= distance(c)) return a[2];
  return distance(b) <= distance(c) ? b[2] : c[2];
}

}  // namespace

TinErrors measure_surface(std::span<const double> x, std::span<const double> y,
                          std::span<const double> z, std::span<const Point3> vertices,
                          std::span<const Corners> triangles, const base::StopCheck& check_stop) {
  if (x.size() != y.size() || x.size() != z.size())
    throw std::invalid_argument("measure_surface: x, y and z must have equal lengths");
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t v : triangles[t])
      if (v >= vertices.size())
        throw std::invalid_argument("measure_surface: triangle " + std::to_string(t) +
                                    " names a vertex that does not exist");
  TinErrors result;
  result.uncovered = x.size();
  if (triangles.empty()) return result;
  const Raster raster(vertices, triangles);
  double squares = 0;
  // Makes the result independent of the order of samples.
  const auto precedes = [&](std::size_t a, std::size_t b) {
    return std::array{x[a], y[a], z[a]} < std::array{x[b], y[b], z[b]};
  };
  base::StopTicks ticks(check_stop);
  for (std::size_t i = 0; i < x.size(); ++i) {
    ticks(64);
    const Corners* corners = raster.find(x[i], y[i]);
    if (corners == nullptr) continue;
    const double height = height_at(vertices[(*corners)[0]], vertices[(*corners)[1]],
                                    vertices[(*corners)[2]], x[i], y[i]);
    const double error = std::abs(height - z[i]);
    ++result.covered;
    squares += error * error;
    if (error > result.largest ||
        (error == result.largest && error > 0 && precedes(i, result.largest_at))) {
      result.largest = error;
      result.largest_at = static_cast<std::uint32_t>(i);
    }
  }
  result.uncovered -= result.covered;
  if (result.covered > 0) result.rms = std::sqrt(squares / static_cast<double>(result.covered));
  return result;
}

}  // namespace terrace::tri
