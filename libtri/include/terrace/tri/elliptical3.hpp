// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/metric3.hpp"

namespace terrace::tri {

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
  /// Of the original coordinates: equal to that of a Delaunay3<double> with the same tetrahedra.
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

}  // namespace terrace::tri
