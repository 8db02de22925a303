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
/// max_latitude: the y of the north pole, see CoordinateSystem::most_latitude(). file, where: named
/// in the error. Without `where`, the error names the place. beyond: tolerance in degrees.
void check_latitudes(std::span<const Point2> places, double max_latitude, const std::string& file,
                     const std::string& where = {}, double beyond = 0);
/// Returns the y of the north pole if y is a latitude, otherwise infinity.
double most_latitude(const stream::Crs& crs);

/// Returns the latitude in degrees. A latitude that exceeds a pole only by rounding becomes the
/// pole, and one that exceeds it by more becomes NaN.
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

/// Checks the bounds of a store, because it may have been built without this check. Throws: as
/// above.
void check_latitudes(const stream::Store& store);

}  // namespace terrace::terrain
