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

/// A polygon with holes; the first ring is the outer one. Rings need not repeat their first point,
/// have either orientation, and may have repeated consecutive corners.
using Polygon = std::vector<std::vector<Point2>>;

/// How a box overlaps a region.
enum class Overlap : std::uint8_t {
  none,   ///< no point in common
  part,   ///< some points of the box are inside, others may be outside
  whole,  ///< every point of the box is inside
};

class RegionShape;

/// The CRS of a GeoJSON file's places, as the file states it.
struct PlacesCrs {
  std::string name;  ///< from its `crs` member; empty: it has none
  std::string file;  ///< source file, for messages
};

/// A closed part of space in the coordinates of a CRS: a box, or a set of polygons. A place is
/// inside polygons if it is on a ring, or within an outer ring and outside its holes. Polygons may
/// overlap.
///
/// Copies share the prepared data. Several threads may call const functions at once. Checking and
/// preparing polygons with 100,000 corners takes a third of a second and up to 90 MB. Queries take
/// constant time, except near a ring, where they take microseconds.
class Region {
 public:
  /// text: "minx,miny,maxx,maxy", "minx,miny,minz,maxx,maxy,maxz", or the name of a GeoJSON file
  /// (Polygon, MultiPolygon, GeometryCollection, Feature or FeatureCollection of these). crs()
  /// returns the file's CRS, and RegionConversion converts from it to the CRS of the data. Throws:
  /// UsageError for numbers that are not a box; stream::Error for a file that is not a region or
  /// has an invalid polygon, as of_polygons(); stream::Stopped.
  static Region parse(const std::string& text, const std::stop_token& stop = {});

  static Region of_box(const stream::Box3& box);
  /// Returns the same region with another extent().
  [[nodiscard]] Region with_extent(const stream::Box3& extent) const;
  /// Returns the union of polygons, each with heights from `low` to `high`. file: named in errors.
  /// Throws: stream::Error if there are no polygons or one is invalid (a ring that crosses itself
  /// or touches itself along a line, has fewer than three corners, no area or a coordinate that is
  /// not finite; a hole outside; holes that cross), naming polygon, ring and place;
  /// stream::Stopped.
  static Region of_polygons(std::vector<Polygon> polygons, double low, double high,
                            const std::string& file = {}, const std::stop_token& stop = {});

  /// The CRS of the places; nullopt: the CRS of the data.
  [[nodiscard]] const std::optional<PlacesCrs>& crs() const { return crs_; }
  /// Returns the region with the same coordinates and another CRS.
  [[nodiscard]] Region in_crs(std::optional<PlacesCrs> crs) const;
  /// The smallest box around the region. Its z is unbounded if the region has no heights.
  [[nodiscard]] const stream::Box3& box() const { return box_; }
  /// The box that rasters of the region cover. It is box(), unless with_extent() widened it to
  /// include cells that rounding would leave out.
  [[nodiscard]] const stream::Box3& extent() const { return extent_ ? *extent_ : box_; }
  /// The polygons; empty if the region is a box.
  [[nodiscard]] const std::vector<Polygon>& polygons() const;
  [[nodiscard]] bool contains(const stream::Point3& p) const;
  /// Whether the place is inside, at any height.
  [[nodiscard]] bool covers(const Point2& place) const;
  /// Restricts a source to the points inside; the box lets it skip reading. Polygons must be in the
  /// CRS of the source.
  void restrict(stream::Selection& selection) const;
  /// Classifies a closed box. An empty box overlaps nothing. Also returns `part` for boxes inside
  /// that touch a ring.
  [[nodiscard]] Overlap overlap(const stream::Box3& box) const;
  /// Whether the triangle, seen from above, has a point in common with the region, and their ranges
  /// of heights overlap. Requires finite corners.
  [[nodiscard]] bool touches(const std::array<stream::Point3, 3>& triangle) const;

 private:
  static Region of_shape(std::shared_ptr<const RegionShape> shape, double low, double high);

  stream::Box3 box_;
  std::optional<stream::Box3> extent_;
  std::optional<PlacesCrs> crs_;
  std::shared_ptr<const RegionShape> shape_;  ///< null: the box itself
};

}  // namespace terrace::terrain
