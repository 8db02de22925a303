// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <terrace/stream/point.hpp>

namespace terrace::terrain {

using Point2 = std::array<double, 2>;

/// A polygon with holes: the first ring is the outer one. Rings need not repeat their first point.
using Polygon = std::vector<std::vector<Point2>>;

/// A part of space in the coordinates of a CRS, closed: a box, or polygons. A place is inside a
/// polygon if it is on a ring or inside by the even-odd rule over all rings; told exactly.
class Region {
 public:
  /// text: "minx,miny,maxx,maxy", "minx,miny,minz,maxx,maxy,maxz", or the name of a GeoJSON file
  /// (Polygon, MultiPolygon, GeometryCollection, Feature or FeatureCollection of these).
  /// Throws: UsageError for numbers that are no box, stream::Error for a file that is no region.
  static Region parse(const std::string& text);

  static Region of_box(const stream::Box3& box);
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

}  // namespace terrace::terrain
