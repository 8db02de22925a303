// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "../free_slots.hpp"
#include "../journal.hpp"
#include "../pool.hpp"

/// The data of a triangulation and the operations that all algorithms share. Contains no geometry.

namespace terrace::tri::planar {

/// Beyond each hull edge is a ghost triangle that joins it to this vertex "at infinity". Every edge
/// therefore has two triangles, and the whole is a sphere: n vertices have 2 n - 2 triangles,
/// including ghosts.
inline constexpr std::uint32_t kGhost = 0;
inline constexpr std::uint32_t kFreeCorner = 0xFFFFFFFFu;

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// A side of a triangle: triangle * 4 + index of the corner opposite to it.
using Side = std::uint32_t;

constexpr Side make_side(std::uint32_t triangle, std::uint32_t index) {
  return triangle * 4 + index;
}
constexpr std::uint32_t triangle_of(Side side) { return side >> 2; }
constexpr std::uint32_t index_of(Side side) { return side & 3; }

/// Next and previous index of 0, 1, 2 counter-clockwise, looked up in a constant.
constexpr std::uint32_t next_index(std::uint32_t i) { return 0b001001u >> (2 * i) & 3; }
constexpr std::uint32_t previous_index(std::uint32_t i) { return 0b010010u >> (2 * i) & 3; }

struct Triangle {
  /// Counter-clockwise. In a free slot the first corner is kFreeCorner.
  std::array<std::uint32_t, 3> corner;
  /// mate[i]: the edge opposite to corner[i], as a side of the neighbour, so that the neighbour's
  /// corner beyond it is found without a search.
  std::array<Side, 3> mate;
};
static_assert(sizeof(Triangle) == 24);

constexpr bool has_ghost(const std::array<std::uint32_t, 3>& corner) {
  // One branch instead of three: a ghost's smallest corner is zero.
  return std::min(corner[0], std::min(corner[1], corner[2])) == kGhost;
}
/// True for a finite triangle in use.
constexpr bool is_finite(const std::array<std::uint32_t, 3>& corner) {
  return corner[0] != kFreeCorner && !has_ghost(corner);
}

/// In Mesh::incident: an existing vertex without triangles (all points are collinear).
inline constexpr std::uint32_t kNoIncident = 0x7FFFFFFFu;
/// In Mesh::incident: the slot is free.
inline constexpr std::uint32_t kFreeVertexBit = 0x80000000u;

/// A simple polygon that removal fills with triangles, see fill.cpp. Scratch memory.
template <class Point>
struct Hole {
  std::vector<std::uint32_t> vertex;  ///< counter-clockwise. May contain the ghost
  std::vector<Point> point;           ///< points of `vertex`, in parallel
  /// outer[i]: the side beyond the edge from vertex[i] to the next vertex.
  std::vector<Side> outer;
  std::vector<std::uint32_t> slots;  ///< triangle slots to fill, more than enough
  struct Part {
    std::uint32_t first;
    std::uint32_t last;
    Side mate;
  };
  std::vector<Part> parts;
};

/// The triangles that the removal of a set of vertices takes out, see remove_set.cpp. Scratch
/// memory.
struct Region {
  struct Edge {
    std::uint32_t from;
    std::uint32_t to;
    Side outer;
  };
  std::vector<std::uint32_t> removed;  ///< vertices
  Pool<std::uint32_t> triangles;       ///< those with a removed vertex
  Pool<std::uint32_t> mixed;           ///< those that also have a kept vertex
  std::vector<Edge> boundary;          ///< with the region on the left, in any order
  Pool<Side> rim;                      ///< edges that may be on the boundary
  Pool<Side> queue;
  // The boundary by loops: edge numbers, and the end of each loop among these.
  std::vector<std::uint32_t> loop_edges;
  std::vector<std::size_t> loop_ends;
  std::vector<std::uint8_t> visited;  ///< by edge number
  std::vector<std::uint32_t> pinches;
};

/// The result of insert_point(): a new vertex, or the one that equals the point.
struct Inserted {
  std::uint32_t vertex;
  bool created;
};

/// A window of the integer lattice, see lattice.cpp. A node is the lower left corner of a square
/// and has the same number. Scratch memory.
struct Lattice {
  std::array<std::int32_t, 2> low{};  ///< lower corner of node 0
  std::uint32_t columns = 0;
  std::vector<std::uint32_t> vertex;         ///< by node. kNone: no vertex yet
  std::vector<std::uint32_t> square_number;  ///< by square: 0, or its number in `squares` plus 1
  std::vector<std::uint32_t> squares;        ///< the squares to fill
  std::vector<std::uint32_t> inner_points, outer_points;  ///< numbers of points
  std::vector<Inserted> inserted;                         ///< one for each of `inner_points`
  std::vector<std::uint32_t> slots;  ///< triangle slots, two for each of `squares`
  std::vector<Side> outer_sides;     ///< four for each square: the sides beyond its sides

  [[nodiscard]] std::size_t node(const std::array<std::int32_t, 2>& p) const {
    return static_cast<std::size_t>(p[1] - low[1]) * columns +
           static_cast<std::size_t>(p[0] - low[0]);
  }
  /// A vertex next to a node, or `other`.
  [[nodiscard]] std::uint32_t neighbour(std::size_t node, std::uint32_t other) const {
    for (const std::size_t next :
         {node - 1, node + 1, node - columns, node + columns, node - columns - 1,
          node - columns + 1, node + columns - 1, node + columns + 1}) {
      if (vertex[next] != kNone) return vertex[next];
    }
    return other;
  }
};

template <class KernelT>
struct Mesh {
  using Kernel = KernelT;
  using Point = typename Kernel::Point;

  // By vertex slot. Slot 0 is the ghost.
  Pool<Point> point;
  Pool<std::uint32_t> incident;  ///< a triangle at the vertex, kNoIncident or free
  /// Marks of set removal: empty before the first one, zero between removals.
  Pool<std::uint8_t> mark;
  // By triangle slot. Empty while all points are collinear ("flat").
  Pool<Triangle> triangle;

  /// While flat: all vertices in lexicographic order, which is their order on the line.
  std::vector<std::uint32_t> line;
  bool flat = true;

  std::uint32_t vertex_count = 0;
  std::uint32_t last_vertex = kNone;  ///< an existing vertex, if there is one
  FreeSlots free_vertices;
  FreeSlots free_triangles;

  Journal<Point, 3> journal;
  base::StopTicks ticks;  ///< ticks of building, inserting and removing

  // Scratch memory, kept between calls.
  std::vector<Side> sides;
  std::vector<std::uint32_t> spare;
  Hole<Point> hole;
  Region region;
  Lattice lattice;

  Mesh() {
    point.push_back(Point{});
    incident.push_back(kNoIncident);
  }

  /// Forgets the slots, all of which are free.
  void forget_slots() {
    assert(vertex_count == 0 && flat);
    point.resize(1);
    incident.resize(1);
    mark.resize(0);
    triangle.resize(0);
    free_vertices.clear();
    free_triangles.clear();
  }
  /// Removes everything and releases the memory. The journal goes on recording.
  void clear() {
    if (journal.on()) {
      for (std::uint32_t v = 1; v < point.size(); ++v)
        if (vertex_alive(v)) journal.touch_vertex(v, true, point[v]);
      for (std::uint32_t t = 0; t < triangle.size(); ++t) journal.touch_cell(t, triangle[t].corner);
    }
    Mesh empty;
    empty.journal = std::move(journal);
    empty.ticks = std::move(ticks);
    *this = std::move(empty);
  }

  /// Removes everything and keeps the memory. The journal stops.
  void restart() {
    journal.stop();
    line.clear();
    flat = true;
    vertex_count = 0;
    last_vertex = kNone;
    forget_slots();
  }

  [[nodiscard]] bool vertex_alive(std::uint32_t v) const {
    return v != kGhost && v < incident.size() && (incident[v] & kFreeVertexBit) == 0;
  }
  [[nodiscard]] bool triangle_alive(std::uint32_t t) const {
    return t < triangle.size() && is_finite(triangle[t].corner);
  }

  /// Allocates a slot for the point, without triangles.
  std::uint32_t new_vertex(const Point& p) {
    std::uint32_t v = 0;
    if (!free_vertices.empty()) {
      v = free_vertices.take();
      if (journal.on()) journal.touch_vertex(v, false, p);
      point[v] = p;
      incident[v] = kNoIncident;
    } else {
      v = point.size();
      if (journal.on()) journal.touch_vertex(v, false, p);
      point.push_back(p);
      incident.push_back(kNoIncident);
    }
    ++vertex_count;
    return v;
  }
  void free_vertex_slot(std::uint32_t v) {
    if (journal.on()) journal.touch_vertex(v, true, point[v]);
    incident[v] = kFreeVertexBit;
    free_vertices.put(v);
    --vertex_count;
  }

  /// Allocates a slot for a triangle, which the caller must write.
  std::uint32_t new_triangle() {
    std::uint32_t t = 0;
    if (!free_triangles.empty()) {
      t = free_triangles.take();
    } else {
      t = triangle.size();
      triangle.resize(t + 1);
      triangle[t].corner[0] = kFreeCorner;
    }
    if (journal.on()) journal.touch_cell(t, triangle[t].corner);
    return t;
  }
  /// The next free slots are needed soon and have not been touched for a while.
  void prefetch_free_triangle() const {
    if (free_triangles.empty()) return;
    const std::uint32_t next = free_triangles.next();
    __builtin_prefetch(&triangle[next], 1);
    if (next + 8 < triangle.size()) __builtin_prefetch(&triangle[next + 8], 1);
  }
  /// Must be called before an algorithm overwrites or frees a triangle in use.
  void record(std::uint32_t t) {
    if (journal.on()) [[unlikely]]
      journal.touch_cell(t, triangle[t].corner);
  }
  void free_triangle_slot(std::uint32_t t) {
    triangle[t].corner[0] = kFreeCorner;
    free_triangles.put(t);
  }

  /// Makes two sides each other's mate.
  void link(Side a, Side b) {
    triangle[triangle_of(a)].mate[index_of(a)] = b;
    triangle[triangle_of(b)].mate[index_of(b)] = a;
  }

  /// The finite triangle across the hull edge of a ghost, or t itself if it is finite.
  [[nodiscard]] std::uint32_t finite_side(std::uint32_t t) const {
    const Triangle& at = triangle[t];
    for (std::uint32_t i = 0; i < 3; ++i)
      if (at.corner[i] == kGhost) return triangle_of(at.mate[i]);
    return t;
  }

  /// Index of v among the corners of t.
  [[nodiscard]] std::uint32_t corner_index(std::uint32_t t, std::uint32_t v) const {
    const Triangle& at = triangle[t];
    assert(at.corner[0] == v || at.corner[1] == v || at.corner[2] == v);
    return at.corner[0] == v ? 0 : at.corner[1] == v ? 1 : 2;
  }

  [[nodiscard]] std::size_t bytes() const {
    return point.bytes() + incident.bytes() + mark.bytes() + triangle.bytes() + journal.bytes() +
           free_vertices.bytes() + free_triangles.bytes() +
           (line.capacity() + sides.capacity() + spare.capacity()) * sizeof(std::uint32_t);
  }
};

/// operator== of std::array calls memcmp, which is slow for so few bytes.
template <class Point>
bool same_point(const Point& a, const Point& b) {
  return a[0] == b[0] && a[1] == b[1];
}

/// Lexicographic order, which the perturbation uses and which is the order along any line.
template <class Point>
bool lexicographically_less(const Point& a, const Point& b) {
  return a[0] < b[0] || (a[0] == b[0] && a[1] < b[1]);
}

}  // namespace terrace::tri::planar
