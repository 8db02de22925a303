// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::terrain {

using Point2 = std::array<double, 2>;

/// -1, 0 or 1: c lies right of, on, or left of the directed line a to b. Exact for all doubles
/// whose products neither overflow nor underflow.
/// Source: J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
/// Predicates (1997), doi:10.1007/PL00009321; here one filter and the full expansion.
int orientation(const Point2& a, const Point2& b, const Point2& c);

/// A polygon with holes: the first ring is the outer one. Rings need not repeat their first point.
using Polygon = std::vector<std::vector<Point2>>;

/// True if `p` is inside (even-odd over all rings) or on a ring. Exact. O(vertices).
bool covers(const Polygon& polygon, const Point2& p);

/// A part of space in the coordinates of a CRS, closed: a box, or the polygons of a GeoJSON file.
class Region {
 public:
  /// text: "minx,miny,maxx,maxy", "minx,miny,minz,maxx,maxy,maxz", or the name of a GeoJSON file
  /// (Polygon, MultiPolygon, GeometryCollection, Feature or FeatureCollection of these).
  /// Throws: UsageError for numbers that are no box, stream::Error for a file that is no region.
  static Region parse(const std::string& text);

  /// The union of polygons, each with heights from `low` to `high`.
  static Region of_polygons(std::vector<Polygon> polygons, double low, double high);

  /// The smallest box around the region. Without heights its z is unbounded.
  [[nodiscard]] const stream::Box3& box() const { return box_; }
  [[nodiscard]] const std::vector<Polygon>& polygons() const { return polygons_; }
  [[nodiscard]] bool contains(const stream::Point3& p) const;

 private:
  stream::Box3 box_;
  std::vector<Polygon> polygons_;  ///< none: the box itself
};

/// A region and the level wanted there: "BOX:L" with L a number or "top" (nothing).
struct Focus {
  Region region;
  std::optional<unsigned> level;
};
/// Throws: as Region::parse; UsageError without a level.
Focus parse_focus(const std::string& text);

/// "top" (nothing) or a number from 0 to 255. Throws: UsageError.
std::optional<unsigned> parse_level(const std::string& text);

}  // namespace terrace::terrain
