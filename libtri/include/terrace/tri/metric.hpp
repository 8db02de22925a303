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

/// Elliptical metrics of the plane and of space: one metric as the argument of a triangulation, and
/// fields with a metric per region, to which triangles and tetrahedra are adapted by flips.
///
/// The length of a vector v is |M v|, where M maps an ellipse (ellipsoid) onto the unit circle
/// (sphere): each of its radii has length 1. So |M v|^2 = v^T Q v with the symmetric positive
/// definite Q = M^T M. Source: J. Skala, Algorithms for manipulating large geometric data, 4.1.2,
/// 4.1.3 and 7.4.

namespace terrace::tri {

/// A linear map, row-major. As a metric: finite and invertible. Maps that differ by a rotation, a
/// reflection or a factor give the same triangulation; the usual choice is a symmetric positive
/// definite map.
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

/// The symmetric map of the ellipse with semi-axis `a` along the direction `angle_degrees`,
/// counter-clockwise from +x, and `b` across it (in the unit of the points). So the off-diagonal
/// entry is (1/a - 1/b) sin cos; 4.5 of the thesis as printed has the angle clockwise.
/// Throws: std::invalid_argument for a semi-axis that is not positive and finite or whose
/// reciprocal is infinite, or an angle that is not finite.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, double angle_degrees);
/// The same given (cosine, sine) of the angle, for results that must not depend on the machine's
/// sine. Throws as above, and if their squares do not add up to 1 within 1e-9.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction);
/// The map of the plane that measures vectors with z = 0 as the given map of space does: its upper
/// left part, bit for bit, if it leaves z alone; otherwise a triangular map, rounded. Throws:
/// std::invalid_argument if that is not finite or not invertible.
[[nodiscard]] LinearMap2 plane_map(const LinearMap3& map);

/// The symmetric map of the ellipsoid whose semi-axis i (in the unit of the points) points along
/// row i of `axes`, three orthonormal vectors. Throws: std::invalid_argument for a semi-axis that
/// is not positive and finite or whose reciprocal is infinite, or rows that are not orthonormal to
/// 1e-9.
[[nodiscard]] LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes,
                                       const LinearMap3& axes = kIdentityMap<3>);

/// Throws: std::invalid_argument if the map is not a metric; `what` names it in the message. Exact.
void check_metric(const LinearMap2& map, const std::string& what);
void check_metric(const LinearMap3& map, const std::string& what);

/// The length |M v| of a vector in the metric, rounded.
[[nodiscard]] double metric_length(const LinearMap3& map, const std::array<double, 3>& vector);

/// The elliptical metric of a triangulation: its second template argument and the argument of its
/// constructor. metric().map() returns the map:
///
///   Delaunay2<double, EllipticalMetric2> slanted(ellipse_map(4, 1, 30));
///
/// No vertex lies inside the metric's ellipse (ellipsoid) through the corners of a triangle
/// (tetrahedron), so edges tend to follow the long axes (4.1.2: the points are mapped and
/// triangulated, and the topology is used on the original points).
///
/// Mapped points are never computed. The predicates are exact on the given points and the given
/// map, which may have any finite entries; so this is the Delaunay triangulation of the points
/// mapped without rounding. All triangles (tetrahedra) of the original points have positive areas
/// (volumes) and fill their hull, collinear and coplanar points stay so, and different points never
/// coincide. Ties are broken by the order of the original coordinates, as in the Euclidean metric:
/// the result is a function of the point set and the map alone. A map that preserves circles
/// (spheres) gives the Euclidean triangulation, ties included.
///
/// All members are as in the Euclidean metric, and so are errors, limits and memory, except that
///  - nearest() measures in the metric;
///  - hash() is over the original coordinates: equal to the Euclidean one if the triangles are;
///  - build_grid() does not exist: the triangles of a grid depend on the metric.
/// In space filters decide nearly always as long as the semi-axes differ by a factor of at most
/// some thousands; beyond about 2^28 exact tests decide everything, slowly.
template <std::size_t Dimension>
class EllipticalMetric {
 public:
  using Map = LinearMap<Dimension>;

  /// Not explicit: a map converts to a metric. Throws: std::invalid_argument if the map is not
  /// finite or not invertible.
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

/// A metric as a function of the position: constant in regions.
template <std::size_t Dimension>
class MetricField {
 public:
  using Point = std::array<double, Dimension>;
  using Map = LinearMap<Dimension>;
  struct Region {
    /// Closed; infinite sides are allowed. In the plane only x and y count, see box2().
    Box3 box;
    Map map = kIdentityMap<Dimension>;
  };

  /// An elliptical metric in each box, the Euclidean metric outside (7.4); where boxes overlap, the
  /// first in the list applies. Throws: std::invalid_argument for an empty box, NaN bounds, or a
  /// map that is not a metric, naming its index.
  explicit MetricField(std::vector<Region> regions);
  /// Any function. A region is where it gives one and the same map, whatever its shape; so a
  /// varying metric must be made piecewise constant. Throws: std::invalid_argument if the function
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

/// Chooses triangles of a triangulation; empty: all of them.
using TriangleFilter = std::function<bool(TriangleId)>;

/// The triangles of a triangulation after flipping edges to suit a field of metrics (7.4, figures
/// 7.15 and 7.16). Vertices and hull are those of the triangulation, which is not changed; every
/// triangle is counter-clockwise, starts with its lexicographically smallest corner, and has a
/// positive area.
///
/// A region is where the field gives one map. Guarantees:
///  - A triangle with corners in different regions is one of the given triangulation, and all those
///    are kept: where regions meet nothing changes.
///  - An edge between two triangles whose corners all lie in one region is Delaunay in the metric
///    of that region: neither triangle's ellipse contains the fourth corner.
///  - So within each region these are the constrained Delaunay triangles, in its metric, of the
///    part covered by triangles with all corners in it. With ties broken as in Delaunay2 they are
///    unique: the set of triangles is a function of the points and the field alone, whatever the
///    history of the triangulation.
///  - If all points lie in one region, the triangles are those of a triangulation in its metric.
/// Why flips end: after a flip of an edge between two triangles of one region both are still in it,
/// and the volume below the surface of squared lengths in that region's metric decreases. So no
/// particular order and no guard is needed. In-circle tests are exact on the given coordinates.
///
/// takes_part: triangles for which it is false are left out beforehand, such as those over places
/// without data, and the edges next to them stay. The result covers what the other triangles cover,
/// with as many triangles; the guarantees apply to those. It is called once for each triangle.
/// window: leaves out the triangles whose bounding box does not meet it; only x and y count.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is not a metric, and
/// whatever the field throws. The map is evaluated once per vertex of these triangles. Costs O(n)
/// besides the flips; O(n^2) flips are possible, but there are few unless ellipses are extreme.
/// Holds about 120 bytes per vertex while it runs, including the result.
///
/// Triangulation: any Delaunay2, whether on its own or that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field,
    const TriangleFilter& takes_part = {}, const base::StopCheck& check_stop = {});
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field, const Box3& window);

struct MetricTetrahedra {
  /// In order (see Delaunay3); which corner comes first has no meaning.
  std::vector<std::array<VertexId, 4>> tetrahedra;
  std::size_t flips = 0;
  /// Facets between two tetrahedra of one region that are not Delaunay in its metric although no
  /// flip is possible.
  std::size_t stuck = 0;
};

/// The tetrahedra of a triangulation after flips to suit a field of metrics, like
/// metric_triangles() in the plane. Vertices and hull are those of the triangulation, which is not
/// changed; every tetrahedron has a positive volume, they fill the hull, and each facet belongs to
/// two of them or to the hull.
///
/// A region is where the field gives one map. Guarantees:
///  - A tetrahedron with corners in different regions is one of the given triangulation, and all
///    those are kept: where regions meet nothing changes.
///  - A facet between two tetrahedra whose corners all lie in one region is Delaunay in the metric
///    of that region (neither ellipsoid contains the other's fourth corner, ties broken as in
///    Delaunay3) or counted in `stuck`: there no flip of two tetrahedra into three, three into two,
///    or (with four coplanar corners) four into four or, on the hull, two into two is possible
///    without involving another region.
///  - In a region without stuck facets these are the constrained Delaunay tetrahedra, in its
///    metric, of the part covered by tetrahedra with all corners in it: no ellipsoid contains a
///    vertex of that part that is visible from its tetrahedron.
///  - The set of tetrahedra, and with it `stuck`, is a function of the points and the field alone,
///    whatever the history of the triangulation and the handles: the order of flips depends on
///    coordinates only.
///  - If all points lie in one region, the tetrahedra are those of a triangulation in its
///    metric, and no facet is stuck.
/// Unlike in the plane, flips may get stuck (B. Joe, "Three-dimensional triangulations from local
/// transformations", doi:10.1137/0910044), and a region's part may have no Delaunay tetrahedra at
/// all. A flip decreases the volume below the surface of squared lengths in the region's metric,
/// and regions do not affect each other: so flips end. All tests are exact on the given
/// coordinates.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is not a metric, and
/// whatever the field throws. The map is evaluated once per vertex. O(n log n) besides the flips,
/// of which O(n^2) are possible. Holds about 450 bytes per vertex while it runs, including the
/// result.
///
/// Triangulation: any Delaunay3, whether on its own or that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation,
                                                 const MetricField3& field);

}  // namespace terrace::tri
