// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/latitudes.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "earth/crs/definition.hpp"

namespace terrace::terrain {
namespace {

stream::Error beyond_pole(const std::string& file, const std::string& where, double latitude) {
  return stream::Error(file,
                       fmt::format("the latitude {} is beyond a pole", plain_number(latitude)))
      .at(where);
}

std::string place_text(double x, double y) { return plain_number(x) + ' ' + plain_number(y); }

}  // namespace

void check_latitudes(std::span<const Point2> places, double max_latitude, const std::string& file,
                     const std::string& where, double beyond) {
  const double degrees = 90 / max_latitude;
  for (const auto& [x, y] : places) {
    const double latitude = y * degrees;
    if (!(std::abs(latitude) > 90 + beyond) || !std::isfinite(latitude)) continue;
    if (!std::isnan(latitude_on_earth(latitude))) continue;
    throw beyond_pole(file, where.empty() ? "place " + place_text(x, y) : where, latitude)
        .remedy("pass the longitude before the latitude");
  }
}

double most_latitude(const stream::Crs& crs) {
  const double degrees = degrees_of_latitude(crs);
  return degrees != 0 ? 90 / degrees : std::numeric_limits<double>::infinity();
}

double latitude_on_earth(double degrees) {
  constexpr double kPole = 90, kRounding = 1e-9;
  if (std::abs(degrees) <= kPole) return degrees;
  return std::abs(degrees) <= kPole + kRounding ? std::copysign(kPole, degrees) : NAN;
}

double degrees_of_latitude(const stream::Crs& crs) {
  if (!crs.geographic) return 0;
  if (crs.horizontal_unit == "degree") return 1;
  try {
    const std::optional<CrsDefinition> definition = definition_of(crs);
    if (definition && definition->geographic) return definition->degrees_per_unit;
  } catch (const CrsError&) {
    // Callers that need places report the error.
  }
  return 0;
}

LatitudeCheck::LatitudeCheck(const stream::Placement& placement, std::string file)
    : world_(placement.world),
      file_(std::move(file)),
      degrees_(degrees_of_latitude(placement.crs)) {}

void LatitudeCheck::operator()(std::span<const stream::Point3> stored) const {
  if (degrees_ == 0) return;
  const std::array<double, 6>& m = world_.xy;
  for (const stream::Point3& p : stored) {
    const double y = m[3] * p[0] + m[4] * p[1] + m[5];
    if (!std::isnan(latitude_on_earth(y * degrees_))) continue;
    const double x = m[0] * p[0] + m[1] * p[1] + m[2];
    throw beyond_pole(file_, "point " + place_text(x, y), y * degrees_)
        .remedy(
            stream::message("pass the longitude as x and the latitude as y, or the right {crs}"));
  }
}

void check_latitudes(const stream::Store& store) {
  const stream::Box3& box = store.whole().bounds();
  if (box.empty()) return;
  const std::array<stream::Point3, 4> corners{
      box.min, {box.max[0], box.min[1], 0}, {box.min[0], box.max[1], 0}, box.max};
  LatitudeCheck(store.schema(), store.path().string())(corners);
}

}  // namespace terrace::terrain
