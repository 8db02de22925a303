// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/metric2.hpp"

namespace terrace::tri {

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
  /// Of the original coordinates: equal to that of a Delaunay2<double> with the same triangles.
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

}  // namespace terrace::tri
