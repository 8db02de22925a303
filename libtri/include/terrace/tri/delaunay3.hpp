// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay2.hpp"

/// A dynamic Delaunay tetrahedralisation of space, the counterpart of Delaunay2: exact, canonical,
/// compact.
///
/// The tetrahedra are a function of the point set alone. A symbolic perturbation breaks the ties of
/// cospherical points: all points are lifted to the paraboloid and raised infinitesimally, and
/// lexicographically larger points (x first, then y, then z) are raised infinitely more than
/// smaller ones (O. Devillers, M. Teillaud, "Perturbations for Delaunay and weighted Delaunay 3D
/// triangulations", doi:10.1016/j.comgeo.2010.09.010). Flat tetrahedra do not arise. A removal
/// after an insertion therefore restores exactly the same tetrahedra, in whatever order the
/// operations come.
///
/// Four corners a, b, c, d are "in order" if det(b - a, c - a, d - a) > 0: seen from d, the corners
/// a, b, c turn counter-clockwise in a right-handed frame.

namespace terrace::tri {

/// Like TriangleId: a slot number, valid until an operation removes the tetrahedron.
enum class TetrahedronId : std::uint32_t {};
inline constexpr TetrahedronId kNoTetrahedron{0xFFFFFFFFu};

[[nodiscard]] constexpr std::uint32_t slot(TetrahedronId tetrahedron) {
  return static_cast<std::uint32_t>(tetrahedron);
}

/// Position of a point relative to the tetrahedra, see Delaunay3::locate().
enum class Place3 : std::uint8_t {
  vertex,   ///< equal to a vertex
  edge,     ///< inside an edge, including hull edges
  facet,    ///< inside a facet, including hull facets
  inside,   ///< inside a tetrahedron
  outside,  ///< outside the convex hull. Without tetrahedra, every point that is not a vertex
};

struct Location3 {
  Place3 place = Place3::outside;
  /// vertex, edge, facet, inside: a tetrahedron that contains the point (any of several).
  /// outside: a tetrahedron at a hull facet that the point sees. kNoTetrahedron if there are none.
  TetrahedronId tetrahedron = kNoTetrahedron;
  /// facet, outside: the facet opposite to vertices(tetrahedron)[corner[0]]. edge: the edge
  /// joins the two corners other than corner[0] and corner[1].
  std::array<std::uint8_t, 2> corner = {0, 0};
  /// vertex: the vertex at the point. Otherwise a vertex of the tetrahedron, useful as a hint, or
  /// kNoVertex in an empty triangulation.
  VertexId vertex = kNoVertex;
};

/// A Delaunay triangulation in space.
///
/// - Coord = std::int32_t: exact for coordinates of at most 30 bits (0 <= c < 2^30).
/// - Coord = double: any finite coordinates, with exact predicates. Points are never moved. -0.0
///   and 0.0 are equal.
/// - Metric = EllipticalMetric3 (with doubles): see metric.hpp.
///
/// Empty sets, one or two points, and collinear or coplanar points are valid states without
/// tetrahedra. In these, inserting or removing one vertex moves O(n) entries of 4 bytes. The limits
/// are 2^29 - 2 vertices and 2^30 - 2 tetrahedra, including those that belong to the structure
/// itself. Several threads may call const functions at once.
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
  // All throw std::invalid_argument, naming the index, if a coordinate is not finite or out of
  // range, and std::length_error beyond 2^29 - 2 vertices. The object is then unchanged. After
  // std::bad_alloc, or std::length_error beyond 2^30 - 2 tetrahedra (which many vertices on two
  // curves can make), the object can only be cleared or destroyed.

  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;  ///< false: `vertex` already existed, with the same coordinates
  };

  /// Adds points to an empty triangulation, much faster than insert(). Returns the vertex of each
  /// point. Equal points share a vertex. O(n log n) for points that fill a volume or a surface.
  /// Needs 20 bytes per point for sorting besides the result, freed before the tetrahedra are made.
  /// More than two threads do not help. The result, handles included, does not depend on their
  /// number.
  std::vector<VertexId> build(std::span<const Point> points, unsigned threads = 1);
  /// hint: a vertex near the point, where the walk starts, or kNoVertex for the last vertex used.
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  /// Inserts a set of points near the hint, in any order (it is sorted internally). `results` is
  /// empty or has one entry per point, in the same order. Only one of several equal points counts
  /// as created. Inserts nothing if any point is invalid.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  /// Usually changes only the tetrahedra at the vertex. If the hole that the vertex (or a very
  /// large set) leaves has so many vertices that filling it would cost more than a rebuild, all
  /// tetrahedra are rebuilt. Vertices then keep their handles and tetrahedra do not.
  void remove(VertexId vertex);
  /// Removes a set of different vertices. Fills the space of their tetrahedra as a whole, around
  /// any other vertices inside it. Two to five times as fast as removing them one by one if the set
  /// is compact.
  void remove(std::span<const VertexId> vertices);
  /// Removes everything and releases the memory. A journal goes on recording.
  void clear();
  /// Reserves room for this many vertices, distributed in space, so that nothing is reallocated
  /// until then.
  void reserve(std::size_t vertices);
  /// Sets what build(), insert() and remove() call at intervals, by their threads. After it has
  /// thrown, the object can only be cleared or destroyed.
  void set_check_stop(base::StopCheck check_stop);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Metric& metric() const;
  [[nodiscard]] std::size_t vertex_count() const;
  /// Number of finite tetrahedra, 0 while all points are coplanar. O(1).
  [[nodiscard]] std::size_t tetrahedron_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// The corners in order, as defined above.
  [[nodiscard]] std::array<VertexId, 4> vertices(TetrahedronId tetrahedron) const;
  /// The neighbour opposite to vertices()[i], kNoTetrahedron beyond the hull.
  [[nodiscard]] std::array<TetrahedronId, 4> neighbours(TetrahedronId tetrahedron) const;
  /// A tetrahedron at the vertex, kNoTetrahedron while there are no tetrahedra. O(1).
  [[nodiscard]] TetrahedronId tetrahedron_at(VertexId vertex) const;
  /// Replaces `result` with the vertices that share an edge with this one, sorted by slot. Empty
  /// while all points are coplanar.
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;
  /// Replaces `result` with the tetrahedra that have this corner, sorted by slot. Empty while all
  /// points are coplanar.
  void tetrahedra_at(VertexId vertex, std::vector<TetrahedronId>& result) const;

  /// Upper bounds of vertex and tetrahedron handles. They shrink only in clear() and when an empty
  /// triangulation is built. Some slots below them are free, and some belong to the structure
  /// itself.
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t tetrahedron_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;  ///< accepts any handle. False for kNoVertex
  /// accepts any handle. False for kNoTetrahedron
  [[nodiscard]] bool alive(TetrahedronId tetrahedron) const;
  [[nodiscard]] AliveRange<Delaunay3, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<Delaunay3, TetrahedronId> all_tetrahedra() const {
    return {*this, tetrahedron_slots()};
  }

  /// Finds a point by a remembering visibility walk (O. Devillers, S. Pion, M. Teillaud, "Walking
  /// in a triangulation", doi:10.1142/S0129054102001047) from the hint. The point must be valid as
  /// for insert(). Takes about the cube root of n steps from a distant hint, a few from a near one.
  [[nodiscard]] Location3 locate(const Point& point, VertexId hint = kNoVertex) const;
  /// The vertex nearest to the point, or kNoVertex if the triangulation is empty. Of equally near
  /// vertices it is the lexicographically smallest. Exact. Costs a walk, or O(n) while all points
  /// are coplanar.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const;

  /// A hash of the set of tetrahedra by coordinates, or of the points while there are no
  /// tetrahedra. Equal point sets have equal hashes, whatever their history. O(n).
  [[nodiscard]] std::uint64_t hash() const;
  /// Allocated memory in bytes, including unused capacity.
  [[nodiscard]] std::size_t memory_bytes() const;

  // ---- Observing ------------------------------------------------------------------------------

  /// The net difference between two moments: what was removed and what was added in between. A
  /// reused slot appears on both sides, so apply removals first.
  struct Changes {
    std::vector<VertexId> removed_vertices;
    std::vector<Point> removed_points;  ///< positions of removed_vertices, in parallel
    std::vector<VertexId> added_vertices;
    std::vector<TetrahedronId> removed_tetrahedra;
    /// The former vertices of removed_tetrahedra, in parallel.
    std::vector<std::array<VertexId, 4>> removed_corners;
    std::vector<TetrahedronId> added_tetrahedra;
    void clear();
  };

  /// Starts recording and drops earlier records. While recording, a change costs a few nanoseconds
  /// more per tetrahedron. The journal needs one bit per slot besides the records.
  void start_journal();
  void stop_journal();
  /// Replaces `changes` with the changes since start_journal() or the last call, reusing its
  /// capacity. Recording continues. Requires a started journal. O(number of slots touched).
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
