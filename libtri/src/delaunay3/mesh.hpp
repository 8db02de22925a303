// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <terrace/base/simd.hpp>
#include <terrace/base/stop_check.hpp>

#include "../journal.hpp"
#include "../pool.hpp"
#include "delaunay3/wrap/scan.hpp"
#include "facet_table.hpp"

/// The data of a tetrahedralisation and the operations that all algorithms share. Contains no
/// geometry.

namespace terrace::tri::spatial {

/// Beyond each hull facet is a ghost tetrahedron that joins it to this vertex "at infinity", so
/// every facet has two tetrahedra.
inline constexpr std::uint32_t kGhost = 0;
inline constexpr std::uint32_t kFreeCorner = 0xFFFFFFFFu;

/// A side of a tetrahedron: tetrahedron * 4 + index of the corner opposite to it.
using Side = std::uint32_t;

constexpr Side make_side(std::uint32_t tetrahedron, std::uint32_t index) {
  return tetrahedron * 4 + index;
}
constexpr std::uint32_t tetrahedron_of(Side side) { return side >> 2; }
constexpr std::uint32_t index_of(Side side) { return side & 3; }

struct Tetrahedron {
  /// In order: det(b - a, c - a, d - a) > 0. For a ghost this holds with any point beyond its
  /// facet. In a free slot the first entry is kFreeCorner and the second the next free slot.
  std::array<std::uint32_t, 4> corner;
  /// mate[i]: the facet opposite to corner[i], as a side of the neighbour.
  std::array<Side, 4> mate;
};
static_assert(sizeof(Tetrahedron) == 32);

/// Corners of the facet opposite to corner i, such that corner i and these three are in order.
inline constexpr std::array<std::array<std::uint8_t, 3>, 4> kFacet = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

constexpr std::array<std::uint32_t, 3> facet_of(const Tetrahedron& t, std::uint32_t i) {
  const auto& f = kFacet[i];
  return {t.corner[f[0]], t.corner[f[1]], t.corner[f[2]]};
}

/// Index of the ghost among the corners, or 4.
constexpr std::uint32_t ghost_index(const std::array<std::uint32_t, 4>& corner) {
  std::uint32_t i = 0;
  while (i < 4 && corner[i] != kGhost) ++i;
  return i;
}
constexpr bool has_ghost(const std::array<std::uint32_t, 4>& corner) {
  return corner[0] == kGhost || corner[1] == kGhost || corner[2] == kGhost || corner[3] == kGhost;
}
/// True for a ghost in use.
constexpr bool is_ghost(const std::array<std::uint32_t, 4>& corner) {
  return corner[0] != kFreeCorner && has_ghost(corner);
}
/// True for a finite tetrahedron in use.
constexpr bool is_finite(const std::array<std::uint32_t, 4>& corner) {
  return corner[0] != kFreeCorner && !has_ghost(corner);
}

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;
inline constexpr std::uint32_t kMaxTetrahedra = (std::uint32_t{1} << 30) - 2;

// Vertex::incident holds a tetrahedron at the vertex (below 2^30), or one of these values. Within
// one operation: the vertex's number in a cavity or hole, with this bit.
inline constexpr std::uint32_t kLocalBit = 0x40000000u;
/// During a removal: a vertex that will be removed, and one that is already part of a hole.
inline constexpr std::uint32_t kPendingRemoval = 0x7FFFFFF0u;
inline constexpr std::uint32_t kInHole = 0x7FFFFFF1u;
/// An existing vertex without tetrahedra (all points are coplanar).
inline constexpr std::uint32_t kNoIncident = 0x7FFFFFFFu;
/// The slot is free. The other bits are the next free slot.
inline constexpr std::uint32_t kFreeVertexBit = 0x80000000u;

/// Values of Mesh::mark.
inline constexpr std::uint8_t kUnknown = 0;
inline constexpr std::uint8_t kCollected = 1;  ///< in the cavity or hole
inline constexpr std::uint8_t kKept = 2;       ///< tested and kept

/// Scratch memory of insertion, see cavity_insert.hpp.
struct Cavity {
  struct Facet {
    std::array<std::uint32_t, 3> corner;  ///< in order with the new vertex before them
    Side outer;                           ///< the same facet, seen from outside
    /// local numbers of the corners among the boundary's vertices
    std::array<std::uint32_t, 3> local;
    std::uint32_t slot;  ///< slot of the tetrahedron on the facet
  };
  /// With up to this many facets the boundary has at most 63 vertices, which six bits can number
  /// from 1.
  static constexpr std::size_t kSmall = 2 * 63 - 4;
  static constexpr std::uint32_t kStride = 64;

  std::vector<std::uint32_t> inside;  ///< slots of the tetrahedra in conflict, as a queue
  std::vector<Facet> facets;
  /// The side with a directed edge of local numbers. Never cleared.
  std::vector<Side> by_edge = std::vector<Side>(std::size_t{kStride} * kStride);
  /// The same for large cavities: both vertices of an edge, the smaller first, and a side.
  struct Edge {
    std::uint64_t vertices;
    Side side;
  };
  std::vector<Edge> edges;

  [[nodiscard]] std::size_t bytes() const {
    return inside.capacity() * sizeof(std::uint32_t) + facets.capacity() * sizeof(Facet) +
           by_edge.capacity() * sizeof(Side) + edges.capacity() * sizeof(Edge);
  }
};

/// The hole left by removed vertices: the open facets around it, and the vertices on and in it,
/// which have local numbers. Local number 0 is the ghost. Scratch memory of removal.
template <class Point>
struct Hole {
  struct Facet {
    /// Local numbers, in order with a corner inside the hole before them.
    std::array<std::uint32_t, 3> corner;
    Side outer;  ///< the side beyond, or kMatched once both tetrahedra exist
  };
  static constexpr Side kMatched = 0xFFFFFFFFu;

  std::vector<std::uint32_t> vertex;    ///< by local number
  std::vector<Point> point;             ///< points of `vertex`, in parallel
  std::vector<std::uint32_t> incident;  ///< a new tetrahedron at each vertex
  std::vector<Facet> facets;
  std::vector<std::uint32_t> slots;  ///< slots of the tetrahedra taken out

  // For wrap.hpp: open facets as a stack (some already closed again), and facets by corners.
  std::vector<std::uint32_t> pending;
  std::vector<FacetEntry> table;

  // For wrap.cpp: padded coordinates of the vertices by local number, the values of each vertex for
  // a facet, and numbers of the candidates for the next corner.
  std::vector<double> x, y, z;
  std::vector<double> power, volume;
  std::vector<std::uint32_t> near;
  ScanFunction scan = scan_function(base::best_simd_path());

  [[nodiscard]] std::size_t bytes() const {
    return (vertex.capacity() + incident.capacity() + slots.capacity() + near.capacity() +
            pending.capacity()) *
               sizeof(std::uint32_t) +
           point.capacity() * sizeof(Point) + facets.capacity() * sizeof(Facet) +
           (x.capacity() + y.capacity() + z.capacity() + power.capacity() + volume.capacity()) *
               sizeof(double) +
           table.capacity() * sizeof(FacetEntry);
  }
};

template <class KernelT>
struct Mesh {
  using Kernel = KernelT;
  using Point = typename Kernel::Point;
  using Vertex = typename Kernel::Vertex;  ///< point and incident

  Pool<Vertex> vertex;  ///< slot 0 is the ghost
  /// Covers all points that have existed since the slots were last forgotten.
  typename Kernel::Lattice lattice;
  // By tetrahedron slot. Empty while all points are coplanar ("flat").
  Pool<Tetrahedron> tetrahedron;
  Pool<std::uint8_t> mark;  ///< kUnknown between operations

  /// While flat: all vertices in lexicographic order.
  std::vector<std::uint32_t> flat_vertices;
  /// While flat: those of the waiting vertices that span their point, line or plane.
  std::vector<std::uint32_t> basis;
  bool flat = true;

  std::uint32_t vertex_count = 0;
  std::uint32_t last_vertex = kNone;  ///< an existing vertex, if there is one
  std::uint32_t free_vertex = kFreeVertexBit - 1;
  std::uint32_t free_tetrahedron = kNone;
  std::uint32_t finite_count = 0;  ///< finite tetrahedra

  Journal<Point, 4> journal;
  base::StopTicks ticks;  ///< ticks of building, inserting and removing

  // Scratch memory, kept between calls.
  Cavity cavity;
  Hole<Point> hole;

  Mesh() { vertex.push_back(Vertex{Point{}, kNoIncident}); }

  /// Forgets the slots, all of which are free.
  void forget_slots() {
    assert(vertex_count == 0 && flat);
    vertex.resize(1);
    lattice = {};
    tetrahedron.resize(0);
    mark.resize(0);
    free_vertex = kFreeVertexBit - 1;
    free_tetrahedron = kNone;
  }
  /// Removes everything and releases the memory. The journal goes on recording.
  void clear() {
    if (journal.on()) {
      for (std::uint32_t v = 1; v < vertex.size(); ++v)
        if (vertex_alive(v)) journal.touch_vertex(v, true, vertex[v].point);
      for (std::uint32_t t = 0; t < tetrahedron.size(); ++t) record(t);
    }
    Mesh empty;
    empty.journal = std::move(journal);
    empty.ticks = std::move(ticks);
    *this = std::move(empty);
  }

  [[nodiscard]] bool vertex_alive(std::uint32_t v) const {
    return v != kGhost && v < vertex.size() && (vertex[v].incident & kFreeVertexBit) == 0;
  }
  [[nodiscard]] bool tetrahedron_alive(std::uint32_t t) const {
    return t < tetrahedron.size() && is_finite(tetrahedron[t].corner);
  }

  /// Allocates a slot for the point, without tetrahedra.
  std::uint32_t new_vertex(const Point& p) {
    std::uint32_t v = free_vertex;
    const bool again = v != kFreeVertexBit - 1;
    lattice.add(p);
    if (!again) v = vertex.size();
    if (journal.on()) journal.touch_vertex(v, false, p);
    if (again) {
      free_vertex = vertex[v].incident & ~kFreeVertexBit;
      if (free_vertex != kFreeVertexBit - 1) __builtin_prefetch(&vertex[free_vertex], 1);
      vertex[v] = Vertex{p, kNoIncident};
    } else {
      vertex.push_back(Vertex{p, kNoIncident});
    }
    ++vertex_count;
    return v;
  }
  void free_vertex_slot(std::uint32_t v) {
    if (journal.on()) journal.touch_vertex(v, true, vertex[v].point);
    vertex[v].incident = kFreeVertexBit | free_vertex;
    free_vertex = v;
    --vertex_count;
  }

  /// Allocates a slot for a tetrahedron, which the caller must write.
  std::uint32_t new_tetrahedron() {
    std::uint32_t t = free_tetrahedron;
    if (t != kNone) {
      free_tetrahedron = tetrahedron[t].corner[1];
      if (free_tetrahedron != kNone) __builtin_prefetch(&tetrahedron[free_tetrahedron], 1);
    } else {
      t = tetrahedron.size();
      if (t >= kMaxTetrahedra)
        throw std::length_error("a triangulation holds at most 2^30 - 2 tetrahedra");
      tetrahedron.resize(t + 1);
      mark.resize(t + 1);
      tetrahedron[t].corner[0] = kFreeCorner;
      mark[t] = kUnknown;
    }
    record(t);
    return t;
  }
  /// Must be called before an algorithm overwrites or frees a tetrahedron in use.
  void record(std::uint32_t t) {
    if (journal.on()) [[unlikely]]
      journal.touch_cell(t, tetrahedron[t].corner);
  }
  void free_tetrahedron_slot(std::uint32_t t) {
    tetrahedron[t].corner[0] = kFreeCorner;
    tetrahedron[t].corner[1] = free_tetrahedron;
    free_tetrahedron = t;
  }

  /// Makes two sides each other's mate.
  void link(Side a, Side b) {
    tetrahedron[tetrahedron_of(a)].mate[index_of(a)] = b;
    tetrahedron[tetrahedron_of(b)].mate[index_of(b)] = a;
  }

  /// The finite tetrahedron across the hull facet of a ghost, or t itself if it is finite.
  [[nodiscard]] std::uint32_t finite_side(std::uint32_t t) const {
    const std::uint32_t ghost = ghost_index(tetrahedron[t].corner);
    return ghost < 4 ? tetrahedron_of(tetrahedron[t].mate[ghost]) : t;
  }

  /// Index of v among the corners of t.
  [[nodiscard]] std::uint32_t corner_index(std::uint32_t t, std::uint32_t v) const {
    const auto& corner = tetrahedron[t].corner;
    std::uint32_t i = 0;
    while (i < 3 && corner[i] != v) ++i;
    assert(corner[i] == v);
    return i;
  }

  [[nodiscard]] std::size_t bytes() const {
    return vertex.bytes() + tetrahedron.bytes() + mark.bytes() + journal.bytes() + cavity.bytes() +
           hole.bytes() + (flat_vertices.capacity() + basis.capacity()) * sizeof(std::uint32_t);
  }
};

/// operator== of std::array calls memcmp, which is slow for so few bytes.
template <class Point>
bool same_point(const Point& a, const Point& b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/// Lexicographic order, which the perturbation uses.
template <class Point>
bool lexicographically_less(const Point& a, const Point& b) {
  if (a[0] != b[0]) return a[0] < b[0];
  return a[1] < b[1] || (a[1] == b[1] && a[2] < b[2]);
}

}  // namespace terrace::tri::spatial
