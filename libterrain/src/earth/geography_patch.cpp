// SPDX-License-Identifier: Apache-2.0
#include "earth/geography_patch.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::terrain {
namespace {

constexpr std::size_t kNodes = GeographyPatch::kNodes;

/// Chebyshev's nodes in [0, 1]: the error of the polynomial through them is spread evenly, with
/// extremes at (1 - cos(k pi / 6)) / 2. C. W. Clenshaw, A. R. Curtis 1960; L. N. Trefethen,
/// Approximation Theory and Approximation Practice (2013), chapter 2.
constexpr std::array<double, kNodes> kNode{0.01703708685546585, 0.14644660940672624,
                                           0.37059047744873963, 0.62940952255126037,
                                           0.85355339059327376, 0.98296291314453415};
constexpr double kInner = 0.06698729810778066;
/// Where the polynomials are checked: each sign of the error along one axis with each of the other.
constexpr std::array<Point2, 6> kChecks{
    {{0, 0}, {1, kInner}, {1 - kInner, 1}, {kInner, 1 - kInner}, {0.5, 0.5}, {0, 1}}};

/// Coefficients of the polynomial in t through values at the nodes: row k gives those of t^k.
using NodeMatrix = std::array<std::array<double, kNodes>, kNodes>;
NodeMatrix monomials() {
  NodeMatrix matrix{};
  for (std::size_t i = 0; i < kNodes; ++i) {
    // The product of (t - node) over the others, divided by its value at node i.
    std::array<double, kNodes> product{1};
    double scale = 1;
    std::size_t degree = 0;
    for (std::size_t j = 0; j < kNodes; ++j) {
      if (j == i) continue;
      ++degree;
      for (std::size_t k = degree + 1; k-- > 0;) {
        product[k] = (k > 0 ? product[k - 1] : 0.0) - kNode[j] * product[k];
      }
      scale *= kNode[i] - kNode[j];
    }
    for (std::size_t k = 0; k < kNodes; ++k) matrix[k][i] = product[k] / scale;
  }
  return matrix;
}

/// [k][m]: of s^k t^m, through values[j * kNodes + i] at node i of s and j of t.
std::array<GeographyPatch::Quintic, kNodes> coefficients(
    const std::array<double, kNodes * kNodes>& values, const NodeMatrix& matrix) {
  std::array<GeographyPatch::Quintic, kNodes> along{}, both{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t i = 0; i < kNodes; ++i) along[k][j] += matrix[k][i] * values[j * kNodes + i];
    }
  }
  for (std::size_t k = 0; k < kNodes; ++k) {
    for (std::size_t m = 0; m < kNodes; ++m) {
      for (std::size_t j = 0; j < kNodes; ++j) both[k][m] += matrix[m][j] * along[k][j];
    }
  }
  return both;
}

/// Patches along a side of the box, at most.
constexpr double kMostPatches = 64;
constexpr double kPatchMetres = 20e3;
constexpr double kMetresPerDegree = 111e3;

}  // namespace

GeographyPatch::Row GeographyPatch::row(double t) const {
  Row row{base_};
  for (std::size_t k = 0; k < kNodes; ++k) {
    row.a[k] = value(longitude_[k], t);
    row.b[k] = value(latitude_[k], t);
  }
  return row;
}

std::optional<GeographyPatch> GeographyPatch::fit(
    const Point2& low, const Point2& size, double tolerance,
    const std::function<void(std::span<Point2>)>& exact) {
  static const NodeMatrix matrix = monomials();
  std::array<Point2, kNodes * kNodes + kChecks.size()> places{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    for (std::size_t i = 0; i < kNodes; ++i) {
      places[j * kNodes + i] = {low[0] + kNode[i] * size[0], low[1] + kNode[j] * size[1]};
    }
  }
  for (std::size_t k = 0; k < kChecks.size(); ++k) {
    places[kNodes * kNodes + k] = {low[0] + kChecks[k][0] * size[0],
                                   low[1] + kChecks[k][1] * size[1]};
  }
  exact(places);
  // Longitudes counted on from the first beyond 180, and how far that goes.
  double least = places[0][0], most = places[0][0];
  for (Point2& p : places) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) return std::nullopt;
    p[0] += 360.0 * std::round((places[0][0] - p[0]) / 360.0);
    least = std::min(least, p[0]);
    most = std::max(most, p[0]);
  }
  // Small numbers: powers of t amplify what is rounded.
  GeographyPatch patch;
  patch.base_ = places[0];
  std::array<double, kNodes * kNodes> longitudes{}, latitudes{};
  for (std::size_t i = 0; i < longitudes.size(); ++i) {
    longitudes[i] = places[i][0] - patch.base_[0];
    latitudes[i] = places[i][1] - patch.base_[1];
  }
  patch.longitude_ = coefficients(longitudes, matrix);
  patch.latitude_ = coefficients(latitudes, matrix);
  for (std::size_t k = 0; k < kChecks.size(); ++k) {
    const Point2& truth = places[kNodes * kNodes + k];
    const Row along = patch.row(kChecks[k][1]);
    const double off = std::max(std::abs(along.longitude(kChecks[k][0]) - truth[0]),
                                std::abs(along.latitude(kChecks[k][0]) - truth[1]));
    // Between the places checked the error may be some times larger.
    if (!(off <= tolerance / 8)) return std::nullopt;
  }
  // What the extremes of the places themselves are is not known: a margin for the edges.
  patch.within_turn_ = least - (most - least) >= -180.0 && most + (most - least) <= 180.0;
  return patch;
}

GeographyPatches::GeographyPatches(const Point2& low, const Point2& high, const Point2& longest,
                                   double tolerance,
                                   const std::function<void(std::span<Point2>)>& exact)
    : low_(low) {
  Point2 size{};
  std::array<std::size_t, 2> count{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double extent = high[axis] - low[axis];
    if (!(extent > 0) || !std::isfinite(extent / longest[axis])) return;
    const double patches = std::clamp(std::ceil(extent / longest[axis]), 1.0, kMostPatches);
    size[axis] = extent / patches;
    per_unit_[axis] = patches / extent;
    count[axis] = static_cast<std::size_t>(patches);
  }
  columns_ = count[0];
  rows_ = count[1];
  for (std::size_t i = 0; i < columns_ * rows_; ++i) {
    const Point2 corner{low_[0] + static_cast<double>(i % columns_) * size[0],
                        low_[1] + static_cast<double>(i / columns_) * size[1]};
    patches_.push_back(GeographyPatch::fit(corner, size, tolerance, exact));
  }
}

bool GeographyPatches::convert(Point2& place) const {
  const double s = (place[0] - low_[0]) * per_unit_[0];
  const double t = (place[1] - low_[1]) * per_unit_[1];
  if (patches_.empty() || !(s >= 0 && s <= static_cast<double>(columns_) && t >= 0 &&
                            t <= static_cast<double>(rows_))) {
    return false;
  }
  const std::size_t column = std::min(static_cast<std::size_t>(s), columns_ - 1);
  const std::size_t row = std::min(static_cast<std::size_t>(t), rows_ - 1);
  const std::optional<GeographyPatch>& patch = patches_[row * columns_ + column];
  if (!patch) return false;
  const GeographyPatch::Row along = patch->row(t - static_cast<double>(row));
  const double across = s - static_cast<double>(column);
  place = {along.longitude(across), along.latitude(across)};
  return true;
}

BoxGeography::BoxGeography(const CoordinateSystem& system, const stream::Box3& box)
    : system_(system) {
  const Point2 low{box.min[0], box.min[1]}, high{box.max[0], box.max[1]};
  static_cast<void>(system_.to_geographic(low));
  if (system_.is_geographic() && system_.counts_as_wgs84()) return;  // nothing to compute
  const double metres = system_.is_geographic() ? kMetresPerDegree : system_.metres_per_unit();
  patches_ = {low,
              high,
              {kPatchMetres / metres, kPatchMetres / metres},
              kTolerance,
              [this](std::span<Point2> places) { system_.to_geographic(places); }};
}

void BoxGeography::operator()(std::span<Point2> places) const {
  std::size_t exact = 0;  // the places before that are done; those from here on are not
  for (std::size_t i = 0; i < places.size(); ++i) {
    Point2 place = places[i];
    if (!patches_.convert(place)) continue;
    if (exact < i) system_.to_geographic(places.subspan(exact, i - exact));
    places[i] = {GeographyPatch::in_turn(place[0]), place[1]};
    exact = i + 1;
  }
  if (exact < places.size()) system_.to_geographic(places.subspan(exact));
}

}  // namespace terrace::terrain
