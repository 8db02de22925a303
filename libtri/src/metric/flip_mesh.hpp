// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "delaunay2/mesh.hpp"
#include "delaunay2/predicates.hpp"

/// Linked triangles whose edges can be flipped. There are no ghosts.

namespace terrace::tri::planar {

/// In Triangle::mate: there is no triangle beyond the edge.
inline constexpr Side kNoMate = 0xFFFFFFFFu;

struct FlipMesh {
  std::vector<Triangle> triangle;

  void link(Side inner, Side outer) {
    triangle[triangle_of(inner)].mate[index_of(inner)] = outer;
    if (outer != kNoMate) triangle[triangle_of(outer)].mate[index_of(outer)] = inner;
  }

  /// Replaces the edge between corner i of t and corner k of o by the one that joins these corners,
  /// which becomes side 1 of both.
  void flip(std::uint32_t t, std::uint32_t i, std::uint32_t o, std::uint32_t k) {
    const Triangle one = triangle[t];
    const Triangle other = triangle[o];
    const std::uint32_t p = one.corner[i];
    const std::uint32_t a = one.corner[next_index(i)];
    const std::uint32_t b = one.corner[previous_index(i)];
    const std::uint32_t q = other.corner[k];
    triangle[t].corner = {p, a, q};
    triangle[o].corner = {q, b, p};
    link(make_side(t, 0), other.mate[next_index(k)]);
    link(make_side(t, 2), one.mate[previous_index(i)]);
    link(make_side(o, 0), one.mate[next_index(i)]);
    link(make_side(o, 2), other.mate[previous_index(k)]);
    link(make_side(t, 1), make_side(o, 1));
  }

  /// Flips until no pending side violates the Delaunay condition, with ties broken as in Delaunay2.
  /// a flip adds the sides around it. Only edges for which may_flip(side, mate) is true are
  /// flipped. Calls flipping(t, o) before each flip of the edge between t and o. `point` is indexed
  /// by vertex slot.
  template <class Kernel, class Point, class MayFlip, class Flipping>
  void settle(std::vector<Side>& pending, const std::vector<Point>& point, const MayFlip& may_flip,
              const Flipping& flipping) {
    while (!pending.empty()) {
      const Side side = pending.back();
      pending.pop_back();
      const std::uint32_t t = triangle_of(side), i = index_of(side);
      const Side mate = triangle[t].mate[i];
      if (mate == kNoMate || !may_flip(side, mate)) continue;
      const std::uint32_t o = triangle_of(mate), k = index_of(mate);
      const auto& [a, b, c] = triangle[t].corner;
      // A corner inside the circle is within the angle at the opposite corner, so the four are
      // convex.
      if (!inside_circle<Kernel>(point[a], point[b], point[c], point[triangle[o].corner[k]]))
        continue;
      flipping(t, o);
      flip(t, i, o, k);
      for (const std::uint32_t index : {0u, 2u}) {
        pending.push_back(make_side(t, index));
        pending.push_back(make_side(o, index));
      }
    }
  }
};

}  // namespace terrace::tri::planar
