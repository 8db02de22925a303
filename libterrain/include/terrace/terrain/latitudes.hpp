// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/region.hpp"

/// Latitudes beyond a pole, which data have where latitude and longitude are exchanged, or where
/// metres are declared as degrees. Nothing may be made of them.

namespace terrace::terrain {

/// Throws: stream::Error if one of the places, longitude and latitude, is beyond a pole.
/// most: the y of the north pole, see CoordinateSystem::most_latitude(). file: named in the error;
/// where: likewise, else the place. beyond: how far is let through, in degrees.
void check_latitudes(std::span<const Point2> places, double most, const std::string& file,
                     const std::string& where = {}, double beyond = 0);
/// The y of the north pole where y is a latitude, else infinite.
double most_latitude(const stream::Crs& crs);

/// The latitude in degrees, a pole where rounding alone is beyond it; NaN beyond a pole.
double latitude_on_earth(double degrees);

/// Degrees in a unit of y where y is a latitude, else 0.
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
  double degrees_;  ///< see degrees_of_latitude()
};

/// The same of the bounds of a store, for those that were built without the check.
void check_latitudes(const stream::Store& store);

}  // namespace terrace::terrain
