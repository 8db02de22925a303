// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <terrace/stream/point.hpp>

namespace terrace::stream {
struct Selection;
}

namespace terrace::terrain {

using Point2 = std::array<double, 2>;

/// A polygon with holes: the first ring is the outer one. Rings need not repeat their first point,
/// turn either way, and may repeat a corner at once.
using Polygon = std::vector<std::vector<Point2>>;

/// How a box lies to a region.
enum class Overlap : std::uint8_t {
  none,   ///< no common point
  part,   ///< some points of the box are inside, others need not be
  whole,  ///< every point of the box is inside
};

class RegionShape;

/// What GeoJSON says of the CRS of its places.
struct PlacesCrs {
  std::string name;  ///< of its `crs` member; empty: it has none
  std::string file;  ///< where it is from, for messages
};

/// A part of space in the coordinates of a CRS, closed: a box, or polygons, of which a place is
/// inside if it is on a ring, or within an outer ring and no hole of it. Polygons may overlap.
///
/// Copies share what was prepared. All const functions may be called from several threads.
/// Polygons of 100,000 corners take a third of a second to check and prepare and up to 90 MB;
/// questions are answered in constant time but near a ring, where they cost microseconds.
class Region {
 public:
  /// text: "minx,miny,maxx,maxy", "minx,miny,minz,maxx,maxy,maxz", or the name of a GeoJSON file
  /// (Polygon, MultiPolygon, GeometryCollection, Feature or FeatureCollection of these), of which
  /// crs() tells the CRS: RegionConversion leads from there to the data.
  /// Throws: UsageError for numbers that are not a box, stream::Error for a file that is not a
  /// region or has an invalid polygon, as of_polygons(); stream::Stopped.
  static Region parse(const std::string& text, const std::stop_token& stop = {});

  static Region of_box(const stream::Box3& box);
  /// The same region with another extent().
  [[nodiscard]] Region with_extent(const stream::Box3& extent) const;
  /// The union of polygons, each with heights from `low` to `high`. file: named in errors.
  /// Throws: stream::Error without polygons, or for an invalid one (a ring that crosses or
  /// touches itself along a line, has fewer than three corners, no area or a coordinate that is not
  /// finite; a hole outside; holes that cross), naming polygon, ring and place; stream::Stopped.
  static Region of_polygons(std::vector<Polygon> polygons, double low, double high,
                            const std::string& file = {}, const std::stop_token& stop = {});

  /// In which CRS the places are; nullopt: in that of the data.
  [[nodiscard]] const std::optional<PlacesCrs>& crs() const { return crs_; }
  /// The same places of another CRS.
  [[nodiscard]] Region in_crs(std::optional<PlacesCrs> crs) const;
  /// The smallest box around the region. Without heights its z is unbounded.
  [[nodiscard]] const stream::Box3& box() const { return box_; }
  /// The box that rasters of the region cover: box(), unless that was widened to hold what rounding
  /// would leave out.
  [[nodiscard]] const stream::Box3& extent() const { return extent_ ? *extent_ : box_; }
  /// None: the region is its box.
  [[nodiscard]] const std::vector<Polygon>& polygons() const;
  [[nodiscard]] bool contains(const stream::Point3& p) const;
  /// Whether the place is inside, whatever its height.
  [[nodiscard]] bool covers(const Point2& place) const;
  /// Lets a source deliver the points inside and no others. Its box spares reading. Polygons must
  /// be in the CRS of the source.
  void restrict(stream::Selection& selection) const;
  /// Box: closed; an empty one overlaps nothing. `part` also of boxes inside that touch a ring.
  [[nodiscard]] Overlap overlap(const stream::Box3& box) const;
  /// Whether the triangle, seen from above, has a point in common with the region, and its range of
  /// heights one with the region's. Requires finite corners.
  [[nodiscard]] bool touches(const std::array<stream::Point3, 3>& triangle) const;

 private:
  static Region of_shape(std::shared_ptr<const RegionShape> shape, double low, double high);

  stream::Box3 box_;
  std::optional<stream::Box3> extent_;
  std::optional<PlacesCrs> crs_;
  std::shared_ptr<const RegionShape> shape_;  ///< none: the box itself
};

}  // namespace terrace::terrain
