// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/region.hpp"

/// Detects latitudes beyond a pole, which occur if latitude and longitude are exchanged or metres
/// are declared as degrees. Such data are refused.

namespace terrace::terrain {

/// Throws: stream::Error if one of the places, given as longitude and latitude, is beyond a pole.
/// most: the y of the north pole, see CoordinateSystem::most_latitude(). file, where: named in the
/// error; without `where` it names the place. beyond: tolerance in degrees.
void check_latitudes(std::span<const Point2> places, double most, const std::string& file,
                     const std::string& where = {}, double beyond = 0);
/// Returns the y of the north pole if y is a latitude, otherwise infinity.
double most_latitude(const stream::Crs& crs);

/// Returns the latitude in degrees; the pole if it exceeds it only by rounding, NaN if it exceeds
/// it by more.
double latitude_on_earth(double degrees);

/// Degrees per unit of y if y is a latitude, otherwise 0.
double degrees_of_latitude(const stream::Crs& crs);

/// Throws: stream::Error that names a stored point beyond a pole.
class LatitudeCheck {
 public:
  /// file: named in the error.
  LatitudeCheck(const stream::Placement& placement, std::string file);
  void operator()(std::span<const stream::Point3> stored) const;

 private:
  stream::WorldTransform world_;
  std::string file_;
  double degrees_;  ///< from degrees_of_latitude()
};

/// The same check on the bounds of a store, for stores that were built without it.
void check_latitudes(const stream::Store& store);

}  // namespace terrace::terrain
