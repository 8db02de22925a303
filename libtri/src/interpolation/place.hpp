// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "../delaunay2/double_kernel.hpp"
#include "../delaunay2/int_kernel.hpp"
#include "../delaunay2/mesh.hpp"
#include "../delaunay2/predicates.hpp"

/// The position of a query in doubles within a triangulation of any coordinate type, decided
/// exactly.

namespace terrace::tri::planar {

using Query = DoubleKernel::Point;

inline Query to_query(const IntKernel::Point& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1])};
}
inline const Query& to_query(const DoubleKernel::Point& p) { return p; }

struct QueryPlace {
  enum Kind : std::uint8_t {
    kOutside,   ///< outside the hull
    kVertex,    ///< on corner[0]
    kHullEdge,  ///< inside the hull edge of corner[0] and corner[1]
    kInside,    ///< in `triangle`, including its edges that are not on the hull
  };
  Kind kind = kOutside;
  std::array<std::uint32_t, 2> corner{};
  std::uint32_t triangle = kNone;  ///< a triangle that contains the query, unless flat or outside
};

/// All points are collinear, so the hull is the segment between the outermost.
template <class Kernel>
QueryPlace place_on_line(const Mesh<Kernel>& mesh, const Query& p) {
  const auto next = std::partition_point(mesh.line.begin(), mesh.line.end(), [&](std::uint32_t v) {
    return lexicographically_less(to_query(mesh.point[v]), p);
  });
  if (next == mesh.line.end()) return {};
  const Query b = to_query(mesh.point[*next]);
  if (same_point(b, p)) return {QueryPlace::kVertex, {*next, kNone}, kNone};
  if (next == mesh.line.begin()) return {};
  const Query a = to_query(mesh.point[*(next - 1)]);
  if (DoubleKernel::orientation(a, b, p) != 0) return {};
  return {QueryPlace::kHullEdge, {*(next - 1), *next}, kNone};
}

/// Like walk() in walk.hpp: finds the triangle that contains the query, or a ghost whose edge it
/// sees.
template <class Kernel>
std::uint32_t walk_to(const Mesh<Kernel>& mesh, const Query& p, std::uint32_t start) {
  const auto* const point = mesh.point.data();
  const Triangle* const triangle = mesh.triangle.data();
  const auto separates = [&](const Triangle& t, std::uint32_t side) {
    return DoubleKernel::orientation(to_query(point[t.corner[next_index(side)]]),
                                     to_query(point[t.corner[previous_index(side)]]), p) < 0;
  };
  std::uint32_t at = mesh.finite_side(start);
  std::uint32_t side = 0;
  while (side < 3 && !separates(triangle[at], side)) ++side;
  if (side == 3) return at;
  Side entered = triangle[at].mate[side];
  std::uint32_t random = 0x9E3779B9u;
  while (true) {
    at = triangle_of(entered);
    const Triangle& t = triangle[at];
    if (has_ghost(t.corner)) return at;
    random = random * 1664525u + 1013904223u;
    std::uint32_t first = next_index(index_of(entered));
    std::uint32_t second = previous_index(index_of(entered));
    if ((random >> 31) != 0) std::swap(first, second);
    if (separates(t, first)) {
      entered = t.mate[first];
    } else if (separates(t, second)) {
      entered = t.mate[second];
    } else {
      return at;
    }
  }
}

/// `last`: the triangle to start from. Set to the start of the next search.
template <class Kernel>
QueryPlace find_place(const Mesh<Kernel>& mesh, const Query& p, std::uint32_t& last) {
  if (mesh.flat) return place_on_line(mesh, p);
  last = walk_to(mesh, p, last);
  const Triangle& t = mesh.triangle[last];
  if (has_ghost(t.corner)) return {};
  for (const std::uint32_t v : t.corner)
    if (same_point(to_query(mesh.point[v]), p)) return {QueryPlace::kVertex, {v, kNone}, last};
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (!has_ghost(mesh.triangle[triangle_of(t.mate[i])].corner)) continue;
    const std::uint32_t a = t.corner[next_index(i)];
    const std::uint32_t b = t.corner[previous_index(i)];
    if (DoubleKernel::orientation(to_query(mesh.point[a]), to_query(mesh.point[b]), p) == 0)
      return {QueryPlace::kHullEdge, {a, b}, last};
  }
  return {QueryPlace::kInside, {}, last};
}

/// Calls visit(t, i) for the triangles around a vertex counter-clockwise, including ghosts. Corner
/// i of t is the vertex.
template <class Kernel, class Visit>
void for_each_triangle_at(const Mesh<Kernel>& mesh, std::uint32_t vertex, Visit visit) {
  const std::uint32_t start = mesh.incident[vertex];
  std::uint32_t t = start;
  do {
    const std::uint32_t i = mesh.corner_index(t, vertex);
    visit(t, i);
    t = triangle_of(mesh.triangle[t].mate[next_index(i)]);
  } while (t != start);
}

/// The vertex nearest to the query. Of equally near vertices it is the lexicographically smallest.
/// The comment on nearest() in query.cpp explains why moving to better neighbours finds it.
template <class Kernel>
std::uint32_t nearest_vertex(const Mesh<Kernel>& mesh, const Query& p, std::uint32_t& last) {
  if (mesh.vertex_count == 0) return kNone;
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    return DoubleKernel::compare_distance(p, to_query(mesh.point[a]), to_query(mesh.point[b]));
  };
  if (mesh.flat) {
    // Along the line the distance decreases and then increases. There is no vertex after the last.
    const auto nearest =
        std::partition_point(mesh.line.begin(), mesh.line.end() - 1,
                             [&](const std::uint32_t& v) { return compare(v, *(&v + 1)) > 0; });
    return *nearest;
  }
  last = walk_to(mesh, p, last);
  const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
    const int order = compare(a, b);
    return order < 0 || (order == 0 && lexicographically_less(mesh.point[a], mesh.point[b]));
  };
  const auto& corners = mesh.triangle[mesh.finite_side(last)].corner;
  std::uint32_t best = corners[0];
  for (const std::uint32_t v : {corners[1], corners[2]})
    if (nearer(v, best)) best = v;
  for (std::uint32_t previous = kNone; previous != best;) {
    previous = best;
    for_each_triangle_at(mesh, previous, [&](std::uint32_t t, std::uint32_t i) {
      const std::uint32_t v = mesh.triangle[t].corner[next_index(i)];
      if (v != kGhost && v != best && nearer(v, best)) best = v;
    });
  }
  return best;
}

}  // namespace terrace::tri::planar
