// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <GeographicLib/Geodesic.hpp>

#include "terrace/stream/store.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Metres on the ground between places of a CRS, and along lines that are straight in it.
///
/// Distances are geodesics of WGS 84, or of the system's own ellipsoid if its datum differs and has
/// no shift (GeographicLib; C. F. F. Karney, "Algorithms for geodesics",
/// doi:10.1007/s00190-012-0578-z; accurate to some nanometres). Without a system they are distances
/// in the map.
class LineDistance {
 public:
  /// metres_per_unit: metres per unit of x and y, used without a system and for places that are not
  /// on the earth.
  LineDistance(std::optional<CoordinateSystem> system, double metres_per_unit);
  /// For the CRS of a store.
  static LineDistance of(const stream::Store& store);

  /// Returns the length of the shortest path on the ground, in metres.
  [[nodiscard]] double between(const Point2& a, const Point2& b) const;
  /// Returns the length in metres of a line that is straight in the CRS, as the sum of shortest
  /// paths between points of it at most about a kilometre apart. Along the parallel of 80 degrees
  /// the result is too short by a relative 1e-7.
  [[nodiscard]] double along(const Point2& a, const Point2& b) const;
  /// Returns the number of pieces of at most this length in metres. The estimate is coarse: it
  /// measures degrees at the equator and metres of the map.
  [[nodiscard]] double pieces(const Point2& a, const Point2& b, double metres) const;

 private:
  std::optional<CoordinateSystem> system_;
  GeographicLib::Geodesic earth_;
  double metres_per_unit_;
};

}  // namespace terrace::terrain
