// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"

/// Elliptical metrics of the plane and of space, one everywhere or fields of them, and
/// triangulations in them.
///
/// The length of a vector v is |M v|, where M maps an ellipse (ellipsoid) onto the unit circle
/// (sphere): every radius of it has length 1. So |M v|^2 = v^T Q v with the symmetric positive
/// definite Q = M^T M. Source: J. Skala, Algorithms for manipulating large geometric
/// data, 4.1.2, 4.1.3 and 7.4.

namespace terrace::tri {

/// A linear map of the plane, row-major. As a metric: finite and invertible. Maps that differ by a
/// turn or a mirror, or by a factor, triangulate alike; a symmetric positive definite one is the
/// usual choice.
using LinearMap2 = std::array<double, 4>;

inline constexpr LinearMap2 kIdentityMap2{1, 0, 0, 1};

/// The symmetric map of the ellipse with semi-axis `a` along the direction `angle_degrees`,
/// counter-clockwise from +x, and `b` across it (in the unit of the points). So the entry off the
/// diagonal is (1/a - 1/b) sin cos; 4.5 of the thesis as printed has the angle clockwise.
/// Throws: std::invalid_argument on a semi-axis that is not positive and finite, whose reciprocal
/// is infinite, or an angle that is not finite.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, double angle_degrees);
/// The same where (cosine, sine) of the angle are known, for results that must not depend on the
/// machine's own sine. Throws as above; and if their squares do not add up to 1 within 1e-9.
[[nodiscard]] LinearMap2 ellipse_map(double a, double b, const std::array<double, 2>& direction);
/// A map whose lengths are those of a row-major map of space on vectors without z: its upper left
/// part, bit for bit, if it leaves z alone; else a triangular map, rounded. Throws:
/// std::invalid_argument if that is not finite or not invertible.
[[nodiscard]] LinearMap2 plane_map(const std::array<double, 9>& map);

/// Throws: std::invalid_argument if the map is no metric; `what` names it in the message.
void check_metric(const LinearMap2& map, const std::string& what);

/// A metric as a function of the position: constant in regions.
class MetricField2 {
 public:
  using Point = std::array<double, 2>;
  struct Region {
    Box3 box;  ///< closed; only x and y count, see box2(). Infinite sides are allowed.
    LinearMap2 map = kIdentityMap2;
  };

  /// An elliptical metric in each box, the Euclidean one outside (7.4); where boxes overlap the
  /// first of the list holds. Throws: std::invalid_argument on an empty box, one that is not a
  /// number, or a map that is no metric, naming its index.
  explicit MetricField2(std::vector<Region> regions);
  /// Any function. A region is where it gives one and the same map, whatever its shape; so a metric
  /// that varies must be made constant piece by piece.
  explicit MetricField2(std::function<LinearMap2(const Point&)> map_at);

  /// The map that holds at a position.
  [[nodiscard]] LinearMap2 operator()(const Point& position) const { return map_at_(position); }

 private:
  std::function<LinearMap2(const Point&)> map_at_;
};

/// Dynamic Delaunay triangulation in an elliptical metric: no vertex lies inside the ellipse of the
/// metric through the corners of a triangle, so edges tend to go along the long axis (J. Skala,
/// Algorithms for manipulating large geometric data, 4.1.2: the points are mapped, triangulated
/// there, and the topology is used on the original points).
///
/// No mapped point is ever computed. The predicates are exact on the points given and the map
/// given, which may have any finite coordinates; so it is the Delaunay triangulation of the points
/// mapped without rounding. All triangles of the original points have positive areas, the hull is
/// theirs, collinear points stay collinear, and different points never become one. Ties are broken
/// by the order of the original coordinates, as in Delaunay2: the result is a function of the point
/// set and the map alone. With a map that keeps circles it is that of Delaunay2<double>, ties
/// included.
///
/// All members are as those of Delaunay2<double>, whose types are used, and so are errors, limits
/// and 68 bytes per vertex; see there. MultiresolutionModel<EllipticalDelaunay2> has levels of
/// detail: its constructor takes the empty triangulation with its metric.
class EllipticalDelaunay2 {
 public:
  using Point = Delaunay2<double>::Point;
  using Insertion = Delaunay2<double>::Insertion;
  using Changes = Delaunay2<double>::Changes;

  /// Throws: std::invalid_argument if the map is not finite or has no inverse.
  explicit EllipticalDelaunay2(const LinearMap2& map = kIdentityMap2);
  ~EllipticalDelaunay2();
  /// A moved-from triangulation can only be destroyed or assigned to.
  EllipticalDelaunay2(EllipticalDelaunay2&&) noexcept;
  EllipticalDelaunay2& operator=(EllipticalDelaunay2&&) noexcept;

  [[nodiscard]] const LinearMap2& map() const;

  std::vector<VertexId> build(std::span<const Point> points);
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(VertexId vertex);
  void remove(std::span<const VertexId> vertices);
  void clear();
  void reserve(std::size_t vertices);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;
  [[nodiscard]] std::array<TriangleId, 3> neighbours(TriangleId triangle) const;
  [[nodiscard]] TriangleId triangle_at(VertexId vertex) const;
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;

  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<EllipticalDelaunay2, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<EllipticalDelaunay2, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }

  [[nodiscard]] Location locate(const Point& point, VertexId hint = kNoVertex) const;
  /// The vertex nearest to the point in the metric.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const;
  /// Hashes the original coordinates: equal to that of a Delaunay2<double> with the same triangles.
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  void start_journal();
  void stop_journal();
  void take_changes(Changes& changes);

 private:
  friend struct EllipticalDelaunay2Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The triangles of a triangulation after its edges were flipped to suit a field of metrics (J.
/// Skala, Algorithms for manipulating large geometric data, 7.4, figures 7.15 and 7.16). The
/// vertices and the hull are those of the triangulation, which does not change; every triangle is
/// counter-clockwise, starts with its lexicographically smallest corner, and has a positive area.
///
/// A region is where the field gives one map. Guaranteed:
///  - A triangle with corners in different regions is one of the given triangulation, and all those
///    are kept: where regions meet nothing changes.
///  - An edge between two triangles whose corners all lie in one region is Delaunay in the metric
///    of that region: neither triangle's ellipse contains the fourth corner.
///  - So within each region these are the constrained Delaunay triangles, in its metric, of the
///    part covered by triangles with all corners in it. With ties broken as in Delaunay2 they are
///    unique: the set of triangles is a function of the points and the field alone, whatever the
///    history of the triangulation.
///  - Where all points lie in one region, the triangles are those of EllipticalDelaunay2.
/// For by a flip of an edge between two triangles of one region both stay in it, and the volume
/// below the surface of squared lengths in that region's metric shrinks: so flips end, and no
/// order or guard is needed. In-circle tests are exact on the given coordinates.
///
/// window: triangles whose bounding box does not meet it are left out before, and the edges at
/// those stay; only x and y count. What is said above then holds of the triangles of the window.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is no metric, and what
/// the field throws. The map is asked for once per vertex (of the window). Costs O(n) beside the
/// flips, of which O(n^2) are possible, but few where ellipses are not extreme. Holds about 120
/// bytes per vertex while it runs, the result among them.
///
/// Triangulation: Delaunay2<std::int32_t>, Delaunay2<double> or EllipticalDelaunay2, by itself or
/// that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] std::vector<std::array<VertexId, 3>> metric_triangles(
    const Triangulation& triangulation, const MetricField2& field,
    const std::optional<Box3>& window = std::nullopt);

/// A linear map of space, row-major. As a metric: finite and invertible. Maps that differ by a turn
/// or a mirror, or by a factor, triangulate alike; a symmetric positive definite one is the usual
/// choice.
using LinearMap3 = std::array<double, 9>;

inline constexpr LinearMap3 kIdentityMap3{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// The symmetric map of the ellipsoid whose semi-axis i (in the unit of the points) points along
/// row i of `axes`, three orthonormal vectors. Throws: std::invalid_argument on a semi-axis that is
/// not positive and finite, whose reciprocal is infinite, or rows that are not orthonormal to 1e-9.
[[nodiscard]] LinearMap3 ellipsoid_map(const std::array<double, 3>& semi_axes,
                                       const LinearMap3& axes = kIdentityMap3);

/// Throws: std::invalid_argument if the map is no metric; `what` names it in the message. Exact.
void check_metric(const LinearMap3& map, const std::string& what);

/// The length |M v| of a vector in the metric, rounded.
[[nodiscard]] double metric_length(const LinearMap3& map, const std::array<double, 3>& vector);

/// A metric as a function of the position: constant in regions.
class MetricField3 {
 public:
  using Point = std::array<double, 3>;
  struct Region {
    Box3 box;  ///< closed. Infinite sides are allowed.
    LinearMap3 map = kIdentityMap3;
  };

  /// An elliptical metric in each box, the Euclidean one outside (7.4); where boxes overlap the
  /// first of the list holds. Throws: std::invalid_argument on an empty box, one that is not a
  /// number, or a map that is no metric, naming its index.
  explicit MetricField3(std::vector<Region> regions);
  /// Any function. A region is where it gives one and the same map, whatever its shape; so a metric
  /// that varies must be made constant piece by piece.
  explicit MetricField3(std::function<LinearMap3(const Point&)> map_at);

  /// The map that holds at a position.
  [[nodiscard]] LinearMap3 operator()(const Point& position) const { return map_at_(position); }

 private:
  std::function<LinearMap3(const Point&)> map_at_;
};

/// Dynamic Delaunay tetrahedralisation in an elliptical metric: no vertex lies inside the ellipsoid
/// of the metric through the corners of a tetrahedron, so edges tend to go along the long axes (J.
/// Skala, Algorithms for manipulating large geometric data, 4.1.2: the points are mapped,
/// triangulated there, and the topology is used on the original points).
///
/// No mapped point is ever computed. The predicates are exact on the points given and the map
/// given, which may have any finite coordinates; so it is the Delaunay tetrahedralisation of the
/// points mapped without rounding. All tetrahedra of the original points have positive volumes, the
/// hull is theirs, coplanar points stay coplanar, and different points never become one. Ties are
/// broken by the order of the original coordinates, as in Delaunay3: the result is a function of
/// the point set and the map alone. With a map that keeps spheres it is that of Delaunay3<double>,
/// ties included. Filters decide nearly always while the semi-axes differ by a factor of some
/// thousands; beyond about 2^28 exact tests decide everything, slowly.
///
/// All members are as those of Delaunay3<double>, whose types are used, and so are errors, limits
/// and memory; see there. MultiresolutionModel<EllipticalDelaunay3> has levels of detail: its
/// constructor takes the empty triangulation with its metric.
class EllipticalDelaunay3 {
 public:
  using Point = Delaunay3<double>::Point;
  using Insertion = Delaunay3<double>::Insertion;
  using Changes = Delaunay3<double>::Changes;

  /// Throws: std::invalid_argument if the map is not finite or has no inverse.
  explicit EllipticalDelaunay3(const LinearMap3& map = kIdentityMap3);
  ~EllipticalDelaunay3();
  /// A moved-from triangulation can only be destroyed or assigned to.
  EllipticalDelaunay3(EllipticalDelaunay3&&) noexcept;
  EllipticalDelaunay3& operator=(EllipticalDelaunay3&&) noexcept;

  [[nodiscard]] const LinearMap3& map() const;

  std::vector<VertexId> build(std::span<const Point> points, unsigned threads = 1);
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(VertexId vertex);
  void remove(std::span<const VertexId> vertices);
  void clear();
  void reserve(std::size_t vertices);

  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t tetrahedron_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  [[nodiscard]] std::array<VertexId, 4> vertices(TetrahedronId tetrahedron) const;
  [[nodiscard]] std::array<TetrahedronId, 4> neighbours(TetrahedronId tetrahedron) const;
  [[nodiscard]] TetrahedronId tetrahedron_at(VertexId vertex) const;
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;
  void tetrahedra_at(VertexId vertex, std::vector<TetrahedronId>& result) const;

  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t tetrahedron_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] bool alive(TetrahedronId tetrahedron) const;
  [[nodiscard]] AliveRange<EllipticalDelaunay3, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<EllipticalDelaunay3, TetrahedronId> all_tetrahedra() const {
    return {*this, tetrahedron_slots()};
  }

  [[nodiscard]] Location3 locate(const Point& point, VertexId hint = kNoVertex) const;
  /// The vertex nearest to the point in the metric.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const;
  /// Hashes the original coordinates: equal to that of a Delaunay3<double> with the same
  /// tetrahedra.
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  void start_journal();
  void stop_journal();
  void take_changes(Changes& changes);

 private:
  friend struct EllipticalDelaunay3Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct MetricTetrahedra {
  /// In order (see Delaunay3); which corner is the first means nothing.
  std::vector<std::array<VertexId, 4>> tetrahedra;
  std::size_t flips = 0;
  /// Facets between two tetrahedra of one region that are not Delaunay in its metric and where no
  /// flip is possible.
  std::size_t stuck = 0;
};

/// The tetrahedra of a triangulation after flips that suit a field of metrics, as
/// metric_triangles() in the plane (J. Skala, Algorithms for manipulating large geometric
/// data, 7.4, figures 7.15 and 7.16). The vertices and the hull are those of the triangulation,
/// which does not change; every tetrahedron has a positive volume, they fill the hull, and each
/// facet belongs to two of them or to the hull.
///
/// A region is where the field gives one map. Guaranteed:
///  - A tetrahedron with corners in different regions is one of the given triangulation, and all
///    those are kept: where regions meet nothing changes.
///  - A facet between two tetrahedra whose corners all lie in one region is Delaunay in the metric
///    of that region (neither ellipsoid contains the other's fourth corner, ties broken as in
///    Delaunay3) or counted in `stuck`: there no flip of two tetrahedra into three, three into two,
///    or (with four corners in a plane) four into four or, on the hull, two into two is possible
///    without one of another region.
///  - In a region without a stuck facet these are the constrained Delaunay tetrahedra, in its
///    metric, of the part covered by tetrahedra with all corners in it: no ellipsoid contains a
///    vertex of that part that can be seen from its tetrahedron.
///  - The set of tetrahedra, and with it `stuck`, is a function of the points and the field alone,
///    whatever the history of the triangulation and the handles: flips go by the order of
///    coordinates.
///  - Where all points lie in one region, the tetrahedra are those of EllipticalDelaunay3, and none
///    is stuck.
/// Unlike in the plane flips may get stuck (B. Joe, "Three-dimensional triangulations from local
/// transformations", doi:10.1137/0910044), and the part may have no tetrahedra that are Delaunay.
/// By a flip the volume below the surface of squared lengths in the region's metric shrinks, and
/// regions do not touch each other: so flips end. All tests are exact on the given coordinates.
///
/// Throws: std::invalid_argument if the field gives a map at a vertex that is no metric, and what
/// the field throws. The map is asked for once per vertex. O(n log n) beside the flips, of which
/// O(n^2) are possible. Holds about 450 bytes per vertex while it runs, the result among them.
///
/// Triangulation: Delaunay3<std::int32_t>, Delaunay3<double> or EllipticalDelaunay3, by itself or
/// that of a MultiresolutionModel.
template <class Triangulation>
[[nodiscard]] MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation,
                                                 const MetricField3& field);

}  // namespace terrace::tri
