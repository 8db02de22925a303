// SPDX-License-Identifier: Apache-2.0
#include "earth/line_distance.hpp"

#include <cmath>
#include <utility>

#include <terrace/base/portable_math.hpp>

#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {
namespace {

GeographicLib::Geodesic earth_of(const std::optional<CoordinateSystem>& system) {
  if (!system || system->reaches_wgs84()) return GeographicLib::Geodesic::WGS84();
  const Ellipsoid& ellipsoid = system->definition().ellipsoid;
  return {ellipsoid.semi_major, ellipsoid.flattening()};
}

}  // namespace

LineDistance::LineDistance(std::optional<CoordinateSystem> system, double metres_per_unit)
    : system_(std::move(system)), earth_(earth_of(system_)), metres_per_unit_(metres_per_unit) {}

LineDistance LineDistance::of(const stream::Store& store) {
  check_latitudes(store);
  const stream::Crs& crs = store.schema().crs;
  return {CoordinateSystem::of(crs, store.path().string()),
          metres_in_unit(crs.horizontal_unit).value_or(1.0)};
}

double LineDistance::between(const Point2& a, const Point2& b) const {
  if (system_) {
    std::array<Point2, 2> ends{a, b};
    if (system_->reaches_wgs84()) {
      system_->to_geographic(ends);
    } else {
      system_->to_own_geographic(ends);
    }
    double metres = 0;
    earth_.Inverse(ends[0][1], ends[0][0], ends[1][1], ends[1][0], metres);
    if (std::isfinite(metres)) return metres;
  }
  return metres_per_unit_ * base::hypot(b[0] - a[0], b[1] - a[1]);
}

double LineDistance::pieces(const Point2& a, const Point2& b, double metres) const {
  constexpr double kMetresPerDegree = 111320;
  const double unit = !system_ ? metres_per_unit_
                      : system_->is_geographic()
                          ? kMetresPerDegree * system_->definition().degrees_per_unit
                          : system_->metres_per_unit();
  return std::max(1.0, std::ceil(unit * base::hypot(b[0] - a[0], b[1] - a[1]) / metres));
}

double LineDistance::along(const Point2& a, const Point2& b) const {
  constexpr double kPiece = 1000, kMost = 1e6;
  const double count = std::min(pieces(a, b, kPiece), kMost);
  double sum = 0;
  Point2 from = a;
  for (double i = 1; i <= count; ++i) {
    const double t = i / count;
    const Point2 to = i == count ? b : Point2{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
    sum += between(from, to);
    from = to;
  }
  return sum;
}

}  // namespace terrace::terrain
