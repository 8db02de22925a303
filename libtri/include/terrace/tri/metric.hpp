// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"

/// Elliptical metrics of the plane and of space. A single metric is an argument of a triangulation.
/// A field has a metric per region, and flips adapt triangles and tetrahedra to it.
///
/// The length of a vector v is |M v|, where M maps an ellipse (ellipsoid) onto the unit circle
/// (sphere), so each of the ellipse's radii has length 1. Hence |M v|^2 = v^T Q v with the
/// symmetric positive definite Q = M^T M. Source: J. Skala, Algorithms for manipulating large
/// geometric data, 4.1.2, 4.1.3 and 7.4.

namespace terrace::tri {

/// A linear map, row-major. A map that is a metric is finite and invertible. Maps that differ by a
/// rotation, a reflection or a factor give the same triangulation. The usual choice is a symmetric
/// positive definite map.
template <std::size_t Dimension>
using LinearMap = std::array<double, Dimension * Dimension>;
using LinearMap2 = LinearMap<2>;
using LinearMap3 = LinearMap<3>;

template <std::size_t Dimension>
inline constexpr LinearMap<Dimension> kIdentityMap = [] {
  LinearMap<Dimension> map{};
  for (std::size_t i = 0; i < Dimension; ++i) map[i * Dimension + i] = 1.0;
  return map;
}();

/// Returns the symmetric map of the ellipse with semi-axis `a` along the direction `angle_degrees`,
/// counter-clockwise from +x, and `b` across it, both in the unit of the points. The off-diagonal
/// entry is therefore (1/a - 1/b) sin cos. Equation 4.5 of the thesis, as printed, has the angle
/// clockwise. Throws std::invalid_argument for a semi-axis that is not positive and finite or whose
/// reciprocal is infinite, and for an angle that is not finite.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, double angle_degrees);
/// The same for an angle given by its (cosine, sine), for results that must not depend on the
/// machine's sine. Throws as above, and if their squares do not add up to 1 within 1e-9.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction);
/// Returns the map of the plane that measures vectors with z = 0 as the given map of space does. It
/// is the upper left part of that map, bit for bit, if the map leaves z alone. Otherwise it is a
/// triangular map, rounded. Throws std::invalid_argument if the result is not finite or not
/// invertible.
[[nodiscard]] LinearMap2 plane_map(const LinearMap3& map);

/// Returns the symmetric map of the ellipsoid whose semi-axis i (in the unit of the points) points
/// along row i of `axes`, three orthonormal vectors. Throws std::invalid_argument for a semi-axis
/// that is not positive and finite or whose reciprocal is infinite, and for rows that are not
/// orthonormal to 1e-9.
[[nodiscard]] LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes,
                                       const LinearMap3& axes = kIdentityMap<3>);

/// Throws std::invalid_argument if the map is not a metric. The message calls it `what`. Exact.
void check_metric(const LinearMap2& map, const std::string& what);
void check_metric(const LinearMap3& map, const std::string& what);

/// The length |M v| of a vector in the metric, rounded.
[[nodiscard]] double metric_length(const LinearMap3& map, const std::array<double, 3>& vector);

/// The elliptical metric of a triangulation. Pass it as the second template argument and to the
/// constructor. metric().map() returns the map:
///
///   Delaunay2<double, EllipticalMetric2> slanted(ellipse_map(4, 1, 30));
///
/// No vertex is inside the metric's ellipse (ellipsoid) through the corners of a triangle
/// (tetrahedron), so edges tend to follow the long axes (4.1.2: the points are mapped and
/// triangulated, and the topology is used on the original points).
///
/// Mapped points are never computed. The predicates are exact on the given points and the given
/// map, which may have any finite entries, so the result is the Delaunay triangulation of the
/// points mapped without rounding. All triangles (tetrahedra) of the original points have positive
/// areas (volumes) and fill their hull, collinear and coplanar points stay so, and different points
/// never coincide. The order of the original coordinates breaks ties, as in the Euclidean metric,
/// so the result is a function of the point set and the map alone. A map that preserves circles
/// (spheres) gives the Euclidean triangulation, ties included.
///
/// All members, errors, limits and memory are as in the Euclidean metric, except that
/// - nearest() measures in the metric;
/// - hash() uses the original coordinates, so it equals the Euclidean hash if the triangles are
///   equal;
/// - build_grid() does not exist because the triangles of a grid depend on the metric.
/// In space, filters decide nearly always as long as the semi-axes differ by a factor of at most
/// some thousands. Beyond about 2^28 exact tests decide everything, slowly.
template <std::size_t Dimension>
class EllipticalMetric {
 public:
  using Map = LinearMap<Dimension>;

  /// Not explicit, so that a map converts to a metric. Throws std::invalid_argument if the map is
  /// not finite or not invertible.
  EllipticalMetric(const Map& map = kIdentityMap<Dimension>);

  [[nodiscard]] const Map& map() const { return map_; }

 private:
  Map map_;
};
using EllipticalMetric2 = EllipticalMetric<2>;
using EllipticalMetric3 = EllipticalMetric<3>;

extern template class EllipticalMetric<2>;
extern template class EllipticalMetric<3>;
extern template class Delaunay2<double, EllipticalMetric2>;
extern template class Delaunay3<double, EllipticalMetric3>;

/// A metric as a function of the position, constant within regions.
template <std::size_t Dimension>
class MetricField {
 public:
  using Point = std::array<double, Dimension>;
  using Map = LinearMap<Dimension>;
  struct Region {
    /// Closed. Infinite sides are allowed. In the plane only x and y count, see box2().
    Box3 box;
    Map map = kIdentityMap<Dimension>;
  };

  /// Uses an elliptical metric in each box and the Euclidean metric outside (7.4). Where boxes
  /// overlap, the first in the list applies. Throws std::invalid_argument, naming the index of the
  /// region, for an empty box, NaN bounds, and a map that is not a metric.
  explicit MetricField(std::vector<Region> regions);
  /// Uses any function. A region is a set of positions with the same map, whatever its shape, so a
  /// varying metric must be made piecewise constant. Throws std::invalid_argument if the function
  /// is empty.
  explicit MetricField(std::function<Map(const Point&)> map_at);

  /// The map at a position.
  [[nodiscard]] Map operator()(const Point& position) const { return map_at_(position); }

 private:
  std::function<Map(const Point&)> map_at_;
};
using MetricField2 = MetricField<2>;
using MetricField3 = MetricField<3>;

extern template class MetricField<2>;
extern template class MetricField<3>;

/// Selects triangles of a triangulation. An empty filter selects all of them.
using TriangleFilter = std::function<bool(TriangleId)>;

/// Returns the triangles of a triangulation after flipping edges to suit a field of metrics (7.4,
/// figures 7.15 and 7.16). The given triangulation is not changed, and its vertices and hull stay
/// the same. Every triangle is counter-clockwise, starts with its lexicographically smallest
/// corner, and has a positive area.
///
/// A region is the set of positions with the same map. Guarantees:
/// - A triangle with corners in different regions belongs to the given triangulation, and all such
///   triangles are kept: nothing changes where regions meet.
/// - An edge between two triangles whose corners are all in one region is Delaunay in the metric of
///   that region: neither triangle's ellipse contains the fourth corner.
/// - Within each region these are therefore the constrained Delaunay triangles, in its metric, of
///   the part covered by triangles with all corners in it. With ties broken as in Delaunay2 they
///   are unique: the set of triangles is a function of the points and the field alone, whatever the
///   history of the triangulation.
/// - If all points are in one region, the triangles are those of a triangulation in its metric.
/// Flips end for the following reason. After a flip of an edge between two triangles of one region,
/// both are still in it, and the volume below the surface of squared lengths in that region's
/// metric has decreased. No particular order and no guard against cycles is needed. In-circle tests
/// are exact on the given coordinates.
///
/// filter: triangles for which it returns false are left out beforehand, such as those over
/// areas without data, and the edges next to them stay. The result covers the other triangles, has
/// as many triangles, and the guarantees apply to these. Called once for each triangle. window:
/// leaves out the triangles whose bounding box does not meet it. Only x and y count.
///
/// Throws std::invalid_argument if the field returns a map at a vertex that is not a metric, and
/// whatever the field throws. The map is evaluated once per vertex of these triangles. O(n) plus
/// the flips. O(n^2) flips are possible, but there are few unless ellipses are extreme. Needs about
/// 120 bytes per vertex while it runs, including the result.
///
/// Triangulation: any Delaunay2, also one of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field,
    const TriangleFilter& filter = {}, const base::StopCheck& check_stop = {});
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field, const Box3& window);

struct MetricTetrahedra {
  /// Corners in order (see Delaunay3), starting with any of them.
  std::vector<std::array<VertexId, 4>> tetrahedra;
  std::size_t flips = 0;
  /// Facets between two tetrahedra of one region that are not Delaunay in its metric although no
  /// flip is possible.
  std::size_t stuck = 0;
};

/// Returns the tetrahedra of a triangulation after flips to suit a field of metrics, like
/// metric_triangles() in the plane. The given triangulation is not changed, and its vertices and
/// hull stay the same. Every tetrahedron has a positive volume, together they fill the hull, and
/// each facet belongs to two of them or to the hull.
///
/// A region is the set of positions with the same map. Guarantees:
/// - A tetrahedron with corners in different regions belongs to the given triangulation, and all
///   such tetrahedra are kept: nothing changes where regions meet.
/// - A facet between two tetrahedra whose corners are all in one region is Delaunay in the metric
///   of that region (neither ellipsoid contains the other's fourth corner, ties broken as in
///   Delaunay3) or counted in `stuck`. At a stuck facet no flip is possible without involving
///   another region: neither of two tetrahedra into three, three into two, nor (with four coplanar
///   corners) four into four or, on the hull, two into two.
/// - In a region without stuck facets these are the constrained Delaunay tetrahedra, in its metric,
///   of the part covered by tetrahedra with all corners in it: no ellipsoid contains a vertex of
///   that part that is visible from its tetrahedron.
/// - The set of tetrahedra, and with it `stuck`, is a function of the points and the field alone,
///   whatever the history of the triangulation and the handles, because the order of flips depends
///   on coordinates only.
/// - If all points are in one region, the tetrahedra are those of a triangulation in its metric,
///   and no facet is stuck.
/// Unlike in the plane, flips may get stuck (B. Joe, "Three-dimensional triangulations from local
/// transformations", doi:10.1137/0910044), and a region's part may not have Delaunay tetrahedra at
/// all. Flips end because each one decreases the volume below the surface of squared lengths in the
/// region's metric, and regions do not affect each other. All tests are exact on the given
/// coordinates.
///
/// Throws std::invalid_argument if the field returns a map at a vertex that is not a metric, and
/// whatever the field throws. The map is evaluated once per vertex. O(n log n) plus the flips, of
/// which O(n^2) are possible. Needs about 450 bytes per vertex while it runs, including the result.
///
/// Triangulation: any Delaunay3, also one of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation,
                                                 const MetricField3& field,
                                                 const base::StopCheck& check_stop = {});

}  // namespace terrace::tri
