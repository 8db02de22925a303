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

/// Dynamic Delaunay tetrahedralisation of space, the sibling of Delaunay2: exact, canonical,
/// compact.
///
/// The tetrahedra are a function of the point set alone. Ties of cospherical points are broken by a
/// symbolic perturbation: points are lifted to the paraboloid and raised infinitesimally, the
/// lexicographically larger (x, then y, then z) infinitely more (O. Devillers, M. Teillaud,
/// "Perturbations for Delaunay and weighted Delaunay 3D triangulations",
/// doi:10.1016/j.comgeo.2010.09.010); flat tetrahedra do not arise. So removal after insertion
/// restores exactly the same tetrahedra, in any order of operations.
///
/// Four corners a, b, c, d are in order if det(b - a, c - a, d - a) > 0: seen from d, the corners
/// a, b, c turn counter-clockwise in a right-handed frame.

namespace terrace::tri {

/// Like TriangleId: a slot number, valid until an operation removes the tetrahedron.
enum class TetrahedronId : std::uint32_t {};
inline constexpr TetrahedronId kNoTetrahedron{0xFFFFFFFFu};

[[nodiscard]] constexpr std::uint32_t slot(TetrahedronId tetrahedron) {
  return static_cast<std::uint32_t>(tetrahedron);
}

/// Where a point lies, see Delaunay3::locate().
enum class Place3 : std::uint8_t {
  kVertex,   ///< equal to a vertex
  kEdge,     ///< inside an edge, including those of the hull
  kFacet,    ///< inside a facet, including those of the hull
  kInside,   ///< inside a tetrahedron
  kOutside,  ///< outside the convex hull; anything but kVertex while there is no tetrahedron
};

struct Location3 {
  Place3 place = Place3::kOutside;
  /// kVertex, kEdge, kFacet, kInside: a tetrahedron that contains the point (of several, any);
  /// kOutside: one at a hull facet that the point sees. kNoTetrahedron if there are none.
  TetrahedronId tetrahedron = kNoTetrahedron;
  /// kFacet, kOutside: the facet lies opposite to vertices(tetrahedron)[corner[0]]; kEdge: the edge
  /// joins the two corners other than corner[0] and corner[1].
  std::array<std::uint8_t, 2> corner = {0, 0};
  /// kVertex: that vertex. Otherwise a vertex of the tetrahedron, useful as a hint; kNoVertex in an
  /// empty triangulation.
  VertexId vertex = kNoVertex;
};

/// Coord = std::int32_t: exact for coordinates of at most 30 bits (0 <= c < 2^30).
/// Coord = double: any finite coordinates; exact predicates, points are never moved. -0.0 and 0.0
/// are equal.
/// Metric = EllipticalMetric3, with doubles: see metric.hpp.
///
/// An empty set, one point, two, and collinear or coplanar points are ordinary states without
/// tetrahedra. In these an insertion or removal of one vertex costs O(n) moves of 4 bytes.
/// At most 2^29 - 2 vertices and 2^30 - 2 tetrahedra, including those that belong to the structure
/// itself. Const functions may be called from several threads at once.
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
  // range, and std::length_error beyond 2^29 - 2 vertices; the object is then unchanged. After
  // std::bad_alloc, and std::length_error beyond 2^30 - 2 tetrahedra (which many vertices on two
  // curves can make), the object can only be cleared or destroyed.

  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;  ///< false: `vertex` already existed, with the same coordinates
  };

  /// Adds points to an empty triangulation, fast. Returns the vertex of each point, the same one
  /// for equal points. O(n log n) for points spread like those of a volume or a surface; besides
  /// the result 20 bytes per point for sorting, freed before the tetrahedra are made. More than two
  /// threads do not help; the result, handles included, is the same for any number.
  std::vector<VertexId> build(std::span<const Point> points, unsigned threads = 1);
  /// hint: a vertex near the point, where the walk starts; kNoVertex: the last vertex used.
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  /// Inserts a set near the hint, in any order (it is sorted internally). results: one per point,
  /// in the same order, or empty. Of equal points only one counts as created. If any point is
  /// invalid, nothing is inserted.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  /// Usually changes only the tetrahedra at the vertex. But if the hole left by it (or by a very
  /// large set) has so many vertices that filling it would cost more than a rebuild, all tetrahedra
  /// are rebuilt: vertices keep their handles, tetrahedra do not.
  void remove(VertexId vertex);
  /// Removes a set (all different): the space of its tetrahedra is filled as a whole, around any
  /// other vertices inside it. Two to five times as fast as one by one if the set is compact.
  void remove(std::span<const VertexId> vertices);
  /// Removes everything and releases the memory; a journal continues.
  void clear();
  /// Reserves room for this many vertices, spread in space, without moving memory.
  void reserve(std::size_t vertices);
  /// Sets what build() and insert() call at intervals, by their threads. After it has thrown, the
  /// object can only be cleared or destroyed.
  void set_check_stop(base::StopCheck check_stop);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Metric& metric() const;
  [[nodiscard]] std::size_t vertex_count() const;
  /// Number of finite tetrahedra: 0 while all points are coplanar. O(1).
  [[nodiscard]] std::size_t tetrahedron_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  /// In order, as defined above.
  [[nodiscard]] std::array<VertexId, 4> vertices(TetrahedronId tetrahedron) const;
  /// Neighbour opposite to vertices()[i]; kNoTetrahedron beyond the hull.
  [[nodiscard]] std::array<TetrahedronId, 4> neighbours(TetrahedronId tetrahedron) const;
  /// A tetrahedron at the vertex; kNoTetrahedron while there are no tetrahedra. O(1).
  [[nodiscard]] TetrahedronId tetrahedron_at(VertexId vertex) const;
  /// Vertices joined to this one by an edge, by slot. Empty while all points are coplanar.
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;
  /// Tetrahedra that have this corner, by slot. Empty while all points are coplanar.
  void tetrahedra_at(VertexId vertex, std::vector<TetrahedronId>& result) const;

  /// Upper bounds of vertex and tetrahedron handles; they shrink only by clear() and when an empty
  /// triangulation is built. Not every slot below is in use: some are free, and some belong to the
  /// structure itself.
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t tetrahedron_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;  ///< accepts any handle; false for kNoVertex
  /// accepts any handle; false for kNoTetrahedron
  [[nodiscard]] bool alive(TetrahedronId tetrahedron) const;
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
  /// The vertex nearest to the point, the lexicographically smallest on ties; kNoVertex if empty.
  /// Exact. Costs a walk; O(n) while all points are coplanar.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const;

  /// A hash of the set of tetrahedra by coordinates, or of the points while there are no
  /// tetrahedra: equal for equal point sets whatever their history. O(n).
  [[nodiscard]] std::uint64_t hash() const;
  /// Bytes of memory held, including unused capacity.
  [[nodiscard]] std::size_t memory_bytes() const;

  // ---- Observing ------------------------------------------------------------------------------

  /// The net difference between two moments: what existed at the first and not at the second, and
  /// vice versa. A reused slot appears on both sides: apply removals first.
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

  /// Starts recording and drops earlier records. While recording, a change costs some nanoseconds
  /// per tetrahedron; the journal holds a bit per slot besides the records.
  void start_journal();
  void stop_journal();
  /// The changes since start_journal() or the last call; recording continues. `changes` is
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
