// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <GeographicLib/Geodesic.hpp>

#include "terrace/stream/store.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Metres on the ground between places of a CRS and along lines that are straight in it.
///
/// Geodesics of WGS 84, or of the system's own ellipsoid if its datum is another and has no shift
/// (GeographicLib; C. F. F. Karney, "Algorithms for geodesics", doi:10.1007/s00190-012-0578-z: some
/// nanometres). Without a system, the map's own distances.
class LineDistance {
 public:
  /// metres_per_unit: of x and y, where there is no system or a place is none on the earth.
  LineDistance(std::optional<CoordinateSystem> system, double metres_per_unit);
  /// In the CRS of a store.
  static LineDistance of(const stream::Store& store);

  /// The shortest way on the ground.
  [[nodiscard]] double between(const Point2& a, const Point2& b) const;
  /// The line that is straight in the CRS, as shortest ways between places of it at most some
  /// kilometre apart: a line along the parallel of 80 degrees comes out 1e-7 of its length short.
  [[nodiscard]] double along(const Point2& a, const Point2& b) const;
  /// Pieces of that length at most, by a coarse measure: the equator's degrees, the map's metres.
  [[nodiscard]] double pieces(const Point2& a, const Point2& b, double metres) const;

 private:
  std::optional<CoordinateSystem> system_;
  GeographicLib::Geodesic earth_;
  double metres_per_unit_;
};

}  // namespace terrace::terrain
