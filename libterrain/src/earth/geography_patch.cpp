// SPDX-License-Identifier: Apache-2.0
#include "earth/geography_patch.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::terrain {
namespace {

/// The most patches along a side of the box.
constexpr double kMostPatches = 64;
constexpr double kPatchMetres = 20e3;
constexpr double kMetresPerDegree = 111e3;

}  // namespace

std::optional<GeographyPatch> GeographyPatch::fit(
    const Point2& low, const Point2& size, double tolerance,
    const std::function<void(std::span<Point2>)>& exact) {
  std::array<Point2, QuinticSurface::kPlaces> places = QuinticSurface::places();
  for (Point2& p : places) p = {low[0] + p[0] * size[0], low[1] + p[1] * size[1]};
  exact(places);
  // Unwraps longitudes from the first one, also beyond 180, and finds their range.
  double least = places[0][0], most = places[0][0];
  std::array<double, QuinticSurface::kPlaces> longitudes{}, latitudes{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    Point2& p = places[i];
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) return std::nullopt;
    p[0] += 360.0 * std::round((places[0][0] - p[0]) / 360.0);
    least = std::min(least, p[0]);
    most = std::max(most, p[0]);
    longitudes[i] = p[0];
    latitudes[i] = p[1];
  }
  const auto longitude = QuinticSurface::through(longitudes, tolerance);
  const auto latitude = QuinticSurface::through(latitudes, tolerance);
  if (!longitude || !latitude) return std::nullopt;
  GeographyPatch patch(*longitude, *latitude);
  // The extremes may be between the sampled places, so leave a margin.
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
  std::size_t exact = 0;  // the places before this index are done
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
