// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include <terrace/base/box.hpp>
#include <terrace/base/stop_check.hpp>

/// A dynamic Delaunay triangulation of the plane: exact, canonical, compact.
///
/// The triangulation is a function of the point set alone. A symbolic perturbation breaks the ties
/// of cocircular points: all points are lifted to the paraboloid and raised infinitesimally, and
/// lexicographically larger points (x first, then y) are raised infinitely more than smaller ones
/// (O. Devillers, M. Teillaud, "Perturbations for Delaunay and weighted Delaunay 3D
/// triangulations", doi:10.1016/j.comgeo.2010.09.010). A collapse after an expansion therefore
/// restores exactly the same triangles, in whatever order the operations come.
///
/// x grows to the right and y upwards. "Left" and "counter-clockwise" refer to this frame.

namespace terrace::tri {

/// Handles are 32-bit slot numbers. A vertex handle stays valid until its vertex is removed, a
/// triangle handle until an operation removes the triangle. Freed slots are reused, the most
/// recently freed blocks of 64 first, so plain arrays indexed by slot stay dense.
enum class VertexId : std::uint32_t {};
enum class TriangleId : std::uint32_t {};
inline constexpr VertexId kNoVertex{0xFFFFFFFFu};
inline constexpr TriangleId kNoTriangle{0xFFFFFFFFu};

/// The slot of a handle, used as an array index.
[[nodiscard]] constexpr std::uint32_t slot(VertexId vertex) {
  return static_cast<std::uint32_t>(vertex);
}
[[nodiscard]] constexpr std::uint32_t slot(TriangleId triangle) {
  return static_cast<std::uint32_t>(triangle);
}

using base::Box3;
/// x, y and z or a height.
using base::Point3;

/// The box of a region in the plane. It has no limits in height.
constexpr Box3 box2(double min_x, double min_y, double max_x, double max_y) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {{min_x, min_y, -kInfinity}, {max_x, max_y, kInfinity}};
}

/// Position of a point relative to a triangulation, see Delaunay2::locate().
enum class Place : std::uint8_t {
  vertex,   ///< equal to a vertex
  edge,     ///< inside an edge, including hull edges
  inside,   ///< inside a triangle
  outside,  ///< outside the convex hull. Without triangles, every point that is not a vertex
};

struct Location {
  Place place = Place::outside;
  /// vertex, edge, inside: a triangle that contains the point (either of the two at an edge).
  /// outside: a triangle at a hull edge that the point sees. kNoTriangle if there are no
  /// triangles.
  TriangleId triangle = kNoTriangle;
  /// edge, outside: the edge opposite to vertices(triangle)[edge].
  std::uint8_t edge = 0;
  /// vertex: the vertex at the point. Otherwise a vertex of the triangle, useful as a hint, or
  /// kNoVertex in an empty triangulation.
  VertexId vertex = kNoVertex;
};

/// The occupied slots of a triangulation as an input range, in ascending order. Any change of the
/// triangulation invalidates it.
template <class Triangulation, class Id>
class AliveRange {
 public:
  class Iterator {
   public:
    using value_type = Id;
    using difference_type = std::ptrdiff_t;
    using iterator_category = std::input_iterator_tag;
    using pointer = const Id*;
    using reference = Id;

    Iterator() = default;
    Iterator(const Triangulation* owner, std::uint32_t at, std::uint32_t end)
        : owner_(owner), at_(at), end_(end) {
      skip_free();
    }
    Id operator*() const { return Id{at_}; }
    Iterator& operator++() {
      ++at_;
      skip_free();
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++*this;
      return before;
    }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }

   private:
    void skip_free() {
      while (at_ < end_ && !owner_->alive(Id{at_})) ++at_;
    }
    const Triangulation* owner_ = nullptr;
    std::uint32_t at_ = 0;
    std::uint32_t end_ = 0;
  };

  AliveRange(const Triangulation& owner, std::uint32_t slots) : owner_(&owner), slots_(slots) {}
  [[nodiscard]] Iterator begin() const { return Iterator(owner_, 0, slots_); }
  [[nodiscard]] Iterator end() const { return Iterator(owner_, slots_, slots_); }

 private:
  const Triangulation* owner_;
  std::uint32_t slots_;
};

/// The default metric of a triangulation. Elliptical metrics are in metric.hpp.
struct Euclidean {};

/// A metric for integers in the plane, under which the sides of square windows act as constraints.
/// The windows are [i S, (i + 1) S] x [j S, (j + 1) S] with S = kCells. They are closed, so
/// neighbours share their sides.
///
/// The triangulation is regular (weighted Delaunay). It is the lower hull of the points lifted to C
/// g(x, y) + x^2 + y^2. C is infinitely large, and g is convex, linear in each window, and creased
/// along all sides. Guarantees:
/// - Every point is a vertex, and the triangulation is a function of the point set alone.
/// - The Euclidean triangles of the vertices in a window, ties included, are exactly the triangles
///   with all corners in that window, whatever points are elsewhere.
/// - Consecutive vertices on a side of a window are joined by an edge.
/// - If the four corners of a window are vertices, then no edge crosses its sides. The triangles
///   inside are the Euclidean triangles of the vertices in the window.
/// - Vertices at distance 1 are joined by an edge.
///
/// Circles through the corners of other triangles may contain vertices.
struct Windowed {
  static constexpr unsigned kBits = 7;
  static constexpr std::int32_t kCells = std::int32_t{1} << kBits;  ///< side of a window
};

/// The metrics in which the triangles of every complete grid are known.
template <class Metric>
concept GridMetric = std::is_same_v<Metric, Euclidean> || std::is_same_v<Metric, Windowed>;

/// A Delaunay triangulation in the plane.
///
/// - Coord = std::int32_t: exact for coordinates of at most 30 bits (0 <= c < 2^30). Uses integer
///   arithmetic only, so results are the same on every machine. About 60 bytes per vertex.
/// - Coord = double: any finite coordinates, with exact predicates. Points are never moved. -0.0
///   and 0.0 are equal. About 68 bytes per vertex.
/// - Metric = EllipticalMetric2 (with doubles): see metric.hpp.
/// - Metric = Windowed (with integers): see above.
///
/// Empty sets, one or two points, and collinear points are valid states without triangles. The
/// limit is 2^29 - 2 vertices. Several threads may call const functions at once.
template <class Coord, class Metric = Euclidean>
class Delaunay2 {
 public:
  using Point = std::array<Coord, 2>;

  Delaunay2() : Delaunay2(Metric()) {}
  explicit Delaunay2(const Metric& metric);
  ~Delaunay2();
  /// A moved-from triangulation can only be destroyed or assigned to.
  Delaunay2(Delaunay2&&) noexcept;
  Delaunay2& operator=(Delaunay2&&) noexcept;

  // ---- Changing -------------------------------------------------------------------------------
  // All throw std::invalid_argument, naming the index, if a coordinate is not finite or out of
  // range, and std::length_error beyond 2^29 - 2 vertices. The object is then unchanged. After
  // std::bad_alloc the object can only be cleared or destroyed.

  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;  ///< false: `vertex` already existed, with the same coordinates
  };

  /// Adds points to an empty triangulation, much faster than insert(). Returns the vertex of each
  /// point. Equal points share a vertex. O(n log n). Needs 20 bytes per point for sorting besides
  /// the result, freed before the triangles are made.
  std::vector<VertexId> build(std::span<const Point> points);
  /// Adds the complete grid x0, x0 + step, ... (columns x rows) to an empty triangulation. Writes
  /// the canonical triangles directly, in O(n) and without predicates. Returns the first vertex.
  /// The vertex of column i, row j is that plus j * columns + i. Requires step > 0 and the metric
  /// Euclidean or Windowed. With doubles, product and sum in x0 + i * step are each rounded once.
  /// Throws std::invalid_argument if a result is not exact (use build() then).
  VertexId build_grid(Coord x0, Coord y0, Coord step, std::uint32_t columns,
                      std::uint32_t rows) requires GridMetric<Metric>;
  /// hint: a vertex near the point, where the walk starts, or kNoVertex for the last vertex used.
  Insertion insert(const Point& point, VertexId hint = kNoVertex);
  /// Inserts a set of points near the hint, in any order (it is sorted internally). `results` is
  /// empty or has one entry per point, in the same order. Only one of several equal points counts
  /// as created. Inserts nothing if any point is invalid.
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  void remove(VertexId vertex);
  /// Removes a set of different vertices as one hole (J. Skala, thesis, section 8.1), which is
  /// faster than removing them one by one if the set is compact. Removes them one by one if the
  /// hole cannot be filled as a whole.
  void remove(std::span<const VertexId> vertices);
  /// Removes everything and releases the memory. A journal goes on recording.
  void clear();
  /// Removes everything, keeps the memory and stops a journal. Use it to build one triangulation
  /// after another.
  void restart();
  /// Reserves room for this many vertices, so that nothing is reallocated until then.
  void reserve(std::size_t vertices);
  /// Sets what build(), insert() and remove() call at intervals. After it has thrown, the object
  /// can only be cleared or destroyed.
  void set_check_stop(base::StopCheck check_stop);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Metric& metric() const;
  [[nodiscard]] std::size_t vertex_count() const;
  /// Number of finite triangles, 0 while all points are collinear.
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] Point point(VertexId vertex) const;
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;  ///< counter-clockwise
  /// The neighbour opposite to vertices()[i], kNoTriangle beyond the hull.
  [[nodiscard]] std::array<TriangleId, 3> neighbours(TriangleId triangle) const;
  /// A triangle at the vertex, kNoTriangle while there are no triangles. O(1).
  [[nodiscard]] TriangleId triangle_at(VertexId vertex) const;
  /// Replaces `result` with the vertices that share an edge with this one, counter-clockwise. For a
  /// hull vertex they run from its successor on the hull to its predecessor. While all points are
  /// collinear they are its neighbours on the line.
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;

  /// Upper bounds of vertex and triangle handles. They shrink only in clear() and when an empty
  /// triangulation is built. Some slots below them are free, and some belong to the structure
  /// itself.
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;  ///< accepts any handle. False for kNoVertex
  /// accepts any handle. False for kNoTriangle
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<Delaunay2, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<Delaunay2, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }

  /// Finds a point by a remembering stochastic walk (O. Devillers, S. Pion, M. Teillaud, "Walking
  /// in a triangulation", doi:10.1142/S0129054102001047) from the hint. The point must be valid as
  /// for insert(). Takes about sqrt(n) steps from a distant hint, a few from a near one.
  [[nodiscard]] Location locate(const Point& point, VertexId hint = kNoVertex) const;
  /// The vertex nearest to the point, or kNoVertex if the triangulation is empty. Of equally near
  /// vertices it is the lexicographically smallest. Exact. Costs a walk. Does not exist in the
  /// metric Windowed, whose edges need not lead to the nearest vertex.
  [[nodiscard]] VertexId nearest(const Point& point, VertexId hint = kNoVertex) const
      requires(!std::is_same_v<Metric, Windowed>);

  /// A hash of the set of triangles by coordinates, or of the points while there are no triangles.
  /// Equal point sets have equal hashes, whatever their history. O(n).
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
    std::vector<TriangleId> removed_triangles;
    /// The former vertices of removed_triangles, in parallel.
    std::vector<std::array<VertexId, 3>> removed_corners;
    std::vector<TriangleId> added_triangles;
    void clear();
  };

  /// Starts recording and drops earlier records. While recording, a change costs a few nanoseconds
  /// more per triangle. The journal needs 2 bits per vertex besides the records.
  void start_journal();
  void stop_journal();
  /// Replaces `changes` with the changes since start_journal() or the last call, reusing its
  /// capacity. Recording continues. Requires a started journal. O(number of slots touched).
  void take_changes(Changes& changes);

 private:
  friend struct Delaunay2Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::Changes::clear() {
  removed_vertices.clear();
  removed_points.clear();
  added_vertices.clear();
  removed_triangles.clear();
  removed_corners.clear();
  added_triangles.clear();
}

extern template class Delaunay2<std::int32_t>;
extern template class Delaunay2<std::int32_t, Windowed>;
extern template class Delaunay2<double>;

}  // namespace terrace::tri
