// SPDX-License-Identifier: Apache-2.0
#include "earth/latitudes.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "earth/crs/crs_definition.hpp"

namespace terrace::terrain {

double latitude_on_earth(double degrees) {
  constexpr double kPole = 90, kRounding = 1e-9;
  if (std::abs(degrees) <= kPole) return degrees;
  return std::abs(degrees) <= kPole + kRounding ? std::copysign(kPole, degrees) : NAN;
}

double degrees_of_latitude(const stream::Crs& crs) {
  if (!crs.geographic) return 0;
  if (crs.horizontal_unit == "degree") return 1;
  try {
    const std::optional<CrsDefinition> known = definition_of(crs);
    if (known && known->geographic) return known->degrees_per_unit;
  } catch (const CrsError&) {
    // Callers that need places report what is wrong with it.
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
    throw stream::Error(
        {.file = file_,
         .where = "point " + plain_number(x) + ' ' + plain_number(y),
         .cause = "the latitude " + plain_number(y * degrees_) + " is beyond a pole",
         .remedy = "x is the longitude and y the latitude: exchange them if they are the wrong way "
                   "round, or name the right `crs`"});
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
