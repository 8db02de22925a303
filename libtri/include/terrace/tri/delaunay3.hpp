// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

/// Dynamic Delaunay tetrahedralisation of space, the sibling of Delaunay2: exact, canonical,
/// compact.
///
/// The tetrahedra are a function of the point set alone. Ties of cospherical points are broken by
/// a symbolic perturbation: points are lifted to the paraboloid and raised infinitesimally, the
/// lexicographically larger (x, then y, then z) infinitely more (O. Devillers, M. Teillaud,
/// "Perturbations for Delaunay and weighted Delaunay 3D triangulations",
/// doi:10.1016/j.comgeo.2010.09.010); no flat tetrahedron arises. So removal after insertion gives
/// back the very tetrahedra, in any order of operations.
///
/// Four corners a, b, c, d are in order where det(b - a, c - a, d - a) > 0: seen from d, the
/// corners a, b, c turn counter-clockwise in a right-handed frame.

namespace terrace::tri {

/// As TriangleId: the number of a slot, valid until an operation removes the tetrahedron.
enum class TetrahedronId : std::uint32_t {};
inline constexpr TetrahedronId kNoTetrahedron{0xFFFFFFFFu};

[[nodiscard]] constexpr std::uint32_t slot(TetrahedronId tetrahedron) {
  return static_cast<std::uint32_t>(tetrahedron);
}

/// Where a point lies, see Delaunay3::locate().
enum class Place3 : std::uint8_t {
  kVertex,   ///< equal to a vertex
  kEdge,     ///< inside an edge, those of the hull included
  kFacet,    ///< inside a facet, those of the hull included
  kInside,   ///< inside a tetrahedron
  kOutside,  ///< outside the convex hull; anything but kVertex while there is no tetrahedron
};

struct Location3 {
  Place3 place = Place3::kOutside;
  /// kVertex, kEdge, kFacet, kInside: a tetrahedron that contains the point (of several, any);
  /// kOutside: one at a hull facet that the point sees. kNoTetrahedron without tetrahedra.
  TetrahedronId tetrahedron = kNoTetrahedron;
  /// kFacet, kOutside: the facet lies opposite to vertices(tetrahedron)[corner[0]]; kEdge: the edge
  /// is that of the two corners other than corner[0] and corner[1].
  std::array<std::uint8_t, 2> corner = {0, 0};
  /// kVertex: that vertex. Otherwise a vertex of the tetrahedron, useful as a hint; kNoVertex in an
  /// empty triangulation.
  VertexId vertex = kNoVertex;
};

/// Coord = std::int32_t: exact for coordinates of at most 30 bits (0 <= c < 2^30).
/// Coord = double: any finite coordinates; exact predicates, no point is ever moved. -0.0 and 0.0
/// are equal.
/// Metric = EllipticalMetric3, with doubles: see metric.hpp.
///
/// An empty set, one point, two, and collinear or coplanar points are ordinary states without
/// tetrahedra. Then an insertion or removal of one vertex costs O(n) moves of 4 bytes.
/// At most 2^29 - 2 vertices and 2^30 - 2 tetrahedra, those of the structure's own included.
/// Const functions may be called from several threads at once.
template <class Coord, class Metric = Euclidean>
class Delaunay3 {
 public:
  using Point = std::array<Coord, 3>;

  Delaunay3() : Delaunay3(Metric()) {}
  explicit Delaunay3(const Metric& metric);
  ~Delaunay3();
  /// A moved-from triangulation can only be destroyed or assigned to.
  Delaunay3(Delaunay3&&) noexcept;
  Delaunay3& operator=(Delaunay3&&) noexcept;

  // ---- Changing -------------------------------------------------------------------------------
  // All throw std::invalid_argument naming the index of a coordinate that is not finite or out of
  // range, and std::length_error beyond 2^29 - 2 vertices; the object is then unchanged.
  // std::bad_alloc, and std::length_error beyond 2^30 - 2 tetrahedra (which many vertices on two
  // curves can make), leave an object that can only be cleared or destroyed.

  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;  ///< false: a vertex of equal coordinates was there and is `vertex`
  };

  /// Adds points to an empty triangulation, fast. Returns the vertex of each point, equal points
  /// the same. O(n log n) where points are spread as those of a volume or a surface are; besides
  /// the result 20 bytes per point for sorting, freed before the tetrahedra are made. More than two
  /// threads do not help; the result, handles included, is the same for any number.
  std::vector<VertexId> build(std::span<const Point> points, unsigned threads = 1);
  /// hint: a vertex near the point, where the walk starts; kNoVertex: the last one used.
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  /// Inserts a set near the hint, in any order (it is sorted inside). results: one per point, in
  /// the same order, or empty. Only one of several equal points counts as created. Nothing is
  /// inserted if one point is invalid.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  /// Usually changes the tetrahedra at the vertex only. But where the hole that it leaves (or that
  /// a very large set leaves) has so many vertices that filling it would cost more than a rebuild,
  /// all tetrahedra are rebuilt: vertices keep their handles, tetrahedra do not.
  void remove(VertexId vertex);
  /// Removes a set (all different): what its tetrahedra leave is filled as a whole, with whatever
  /// other vertices stand inside it. Two to five times as fast as one by one where it is compact.
  void remove(std::span<const VertexId> vertices);
  /// Removes everything and gives the memory back; a journal goes on.
  void clear();
  /// Room for this many vertices, spread in space, without moving memory.
  void reserve(std::size_t vertices);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Metric& metric() const;
  [[nodiscard]] std::size_t vertex_count() const;
  /// Finite tetrahedra. 0 while all points are coplanar. O(1).
  [[nodiscard]] std::size_t tetrahedron_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// In order, see above.
  [[nodiscard]] std::array<VertexId, 4> vertices(TetrahedronId tetrahedron) const;
  /// Neighbour opposite to vertices()[i]; kNoTetrahedron beyond the hull.
  [[nodiscard]] std::array<TetrahedronId, 4> neighbours(TetrahedronId tetrahedron) const;
  /// A tetrahedron at the vertex; kNoTetrahedron while there are no tetrahedra. O(1).
  [[nodiscard]] TetrahedronId tetrahedron_at(VertexId vertex) const;
  /// Vertices joined to this one by an edge, by slot. None while all points are coplanar.
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;
  /// Tetrahedra that have this corner, by slot. None while all points are coplanar.
  void tetrahedra_at(VertexId vertex, std::vector<TetrahedronId>& result) const;

  /// Handles of vertices and tetrahedra are below these numbers; they shrink only by clear(), and
  /// when an empty triangulation is built. Not every slot below is alive: some are free, and some
  /// are used by the structure itself.
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t tetrahedron_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;            ///< any handle; false for kNoVertex
  [[nodiscard]] bool alive(TetrahedronId tetrahedron) const;  ///< any; false for kNoTetrahedron
  [[nodiscard]] AliveRange<Delaunay3, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<Delaunay3, TetrahedronId> all_tetrahedra() const {
    return {*this, tetrahedron_slots()};
  }

  /// Finds a point by a remembering visibility walk (O. Devillers, S. Pion, M. Teillaud, "Walking
  /// in a triangulation", doi:10.1142/S0129054102001047) from the hint. The point must be valid as
  /// for insert(). About the cube root of n steps from afar, a few from nearby.
  [[nodiscard]] Location3 locate(const Point& point, VertexId hint = kNoVertex) const;
  /// The vertex nearest to the point, the lexicographically smallest on ties; kNoVertex when
  /// empty. Exact. Costs a walk; O(n) while all points are coplanar.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const;

  /// A hash of the set of tetrahedra by their coordinates, or of the points while there are no
  /// tetrahedra: the same for equal point sets whatever their history. O(n).
  [[nodiscard]] std::uint64_t hash() const;
  /// Bytes of memory held, unused capacity included.
  [[nodiscard]] std::size_t memory_bytes() const;

  // ---- Observing ------------------------------------------------------------------------------

  /// The net difference between two moments: what was there at the first and is not at the second,
  /// and the reverse. A reused slot appears on both sides: apply removals first.
  struct Changes {
    std::vector<VertexId> removed_vertices;
    std::vector<Point> removed_points;  ///< of removed_vertices, in parallel
    std::vector<VertexId> added_vertices;
    std::vector<TetrahedronId> removed_tetrahedra;
    /// The vertices of removed_tetrahedra as they were, in parallel.
    std::vector<std::array<VertexId, 4>> removed_corners;
    std::vector<TetrahedronId> added_tetrahedra;
    void clear();
  };

  /// Starts recording; what was recorded before is dropped. While recording, a change
  /// costs some nanoseconds per tetrahedron, and a bit per slot beside the records is held.
  void start_journal();
  void stop_journal();
  /// The changes since start_journal() or the last call; recording goes on. `changes` is
  /// overwritten and its capacity reused. Requires a started journal. O(number of slots touched).
  void take_changes(Changes& changes);

 private:
  friend struct Delaunay3Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::Changes::clear() {
  removed_vertices.clear();
  removed_points.clear();
  added_vertices.clear();
  removed_tetrahedra.clear();
  removed_corners.clear();
  added_tetrahedra.clear();
}

extern template class Delaunay3<std::int32_t>;
extern template class Delaunay3<double>;

}  // namespace terrace::tri
