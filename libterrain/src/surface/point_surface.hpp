// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/store_query.hpp>

#include "surface/circle_cover.hpp"
#include "surface/corner.hpp"
#include "surface/point_cells.hpp"
#include "surface/point_cloud.hpp"
#include "surface/point_star.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace::terrain {

/// The surface between the points of a cloud at single places. Gives the result of the Delaunay
/// triangulation of all points without constructing it. PointWindow constructs it, for work on all
/// triangles of a box.
///
/// The triangle that contains a place is the solution of a linear programme: of all planes through
/// three lifted points around the place, the lowest. The simplex method finds it: starting from any
/// triangle with the place, a point inside its circle replaces a corner until no point is inside.
/// The triangles around a place are found by offering points nearby to a PointStar. All decisions
/// are exact, and ties are broken as in Delaunay2, so the triangles are those of the whole
/// triangulation, whatever is loaded.
///
/// Points come from the cells of a grid over what load() has read. Where a circle reaches further,
/// they come from the store, by the boxes of its clusters, or, where voids make that slow, from the
/// border of the voids, see PointVoids. Ask for places in an order that keeps neighbours together,
/// because a place is usually in the triangle of the previous one or close to it. About 1 us per
/// place in a loaded box, half a millisecond elsewhere.
///
/// If all points are collinear, or there is only one, the surface is the segment between the
/// outermost points; it has heights but no gradients.
///
/// One object per thread; any number of them share a PointCloud, which must outlive them. All
/// functions throw stream::Error on a damaged store and stream::Stopped.
class PointSurface {
 public:
  /// Requires a cloud with points. memory_bytes: limit for finding the border of the voids; 0: no
  /// limit.
  explicit PointSurface(PointCloud& cloud, TooLong too_long = {}, std::uint64_t memory_bytes = 0);
  PointSurface(const PointSurface&) = delete;
  PointSurface& operator=(const PointSurface&) = delete;

  /// See PointCells::load().
  bool load(const StoredBox& box, std::size_t max_points, bool allow_crowding);
  /// Uses the points of these cells from now on; they must outlive this object.
  void share(const PointCells& cells) { cells_ = &cells; }

  /// The linear surface. On an edge or a point, the height is computed from the points there alone,
  /// and the gradient is the mean over the triangles that meet there. NaN outside the hull.
  /// Triangles with too long an edge are left out; shorter edges and points that have no other
  /// triangle have heights but no gradients. Requires a finite place.
  SurfacePoint linear(const Point2& place);
  /// By Sibson's natural neighbours, see tri::heights_at() and tri::gradients_at(). NaN outside the
  /// hull and where linear() has no height.
  SurfacePoint natural(const Point2& place);
  /// Returns the nearest point, on ties the lexicographically smallest. Requires a finite place.
  Point2 nearest(const Point2& place);
  /// Returns the height of a point of the store, in its vertical unit.
  double height(const Point2& point);
  /// The surface of linear() at the nearest point.
  SurfacePoint at_nearest(const Point2& place) { return at_point(nearest(place)); }

 private:
  /// The height of a point that is not among the loaded ones.
  double read_height(const Point2& point);
  using Corners = std::array<Point2, 3>;  ///< counter-clockwise
  /// A place moved infinitesimally towards another one, and infinitely less to the left of that
  /// direction. So it is not on any line through two points.
  struct Target {
    Point2 place, towards;
  };

  static int side_of(const Point2& a, const Point2& b, const Target& target);
  [[nodiscard]] static bool has(const Corners& triangle, const Target& target);
  /// Returns nullopt outside the hull.
  std::optional<Target> target_of(const Point2& place, PointHull::Side& side) const;
  /// Sets triangle_ to the triangle containing the target, which must be inside the hull.
  void find_triangle(const Target& target);
  /// Sets star_ to that of a place among all points, which may contain the place. Requires a place
  /// that is not outside the hull.
  void find_star(const Point2& centre);
  void narrow_first(const Point2& centre);
  /// Whether the border of the voids is known. Finds it when that is worth its cost.
  bool knows_border();
  /// Sets points_ to the point at a place among collinear points, or else to its two neighbours.
  /// Clears points_ outside the segment.
  void find_on_line(const Point2& place);
  /// Calls visit(point) at least for all points in the covers that are not in memory.
  template <class Visit>
  void read_in(std::span<const CircleCover> covers, const Point2& from, const Visit& visit);

  SurfaceTriangle with_heights(const Corners& corners);
  SurfacePoint at_point(const Point2& point);
  SurfacePoint natural_among(std::vector<Point2>& points, const Point2& place);

  PointCloud& cloud_;
  TooLong too_long_;
  std::uint64_t memory_bytes_;
  bool wants_border_ = false;
  stream::StoreQuery query_;
  /// Which points were offered to star_ in the circle of one of its triangles.
  enum Mark : std::uint8_t { kNone, kMemory, kAll };

  PointCells loaded_;
  const PointCells* cells_ = &loaded_;
  std::optional<Corners> triangle_;  ///< a triangle of the triangulation of all points
  PointStar star_;
  std::vector<SurfaceCorner> corners_;  ///< recent ones, by hash of the place; NaN: none
  std::vector<CircleCover> covers_;
  std::vector<SurfaceTriangle> meeting_;
  std::vector<Point2> points_;
};

}  // namespace terrace::terrain
