// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::planar {

/// The end of a walk.
struct WalkEnd {
  /// The finite triangle that contains the point, including its boundary, or the ghost beyond a
  /// hull edge that the point sees.
  std::uint32_t triangle = kNone;
  bool outside = false;
};

/// Remembering stochastic walk (Devillers, Pion, Teillaud, doi:10.1142/S0129054102001047). Goes
/// from triangle to triangle through an edge that separates the current one from p, and never tests
/// the edge just crossed. A small generator with a fixed seed chooses which of the other two is
/// tried first. The walk cannot cycle in a regular triangulation. `start` may be a ghost.
template <class Kernel>
WalkEnd walk(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t start) {
  using Point = typename Kernel::Point;
  const Point* const point = mesh.point.data();
  const Triangle* const triangle = mesh.triangle.data();
  const auto separates = [&](const Triangle& t, std::uint32_t side) {
    return Kernel::orientation(point[t.corner[next_index(side)]],
                               point[t.corner[previous_index(side)]], p) < 0;
  };

  std::uint32_t at = mesh.finite_side(start);
  Side entered = 0;
  {
    const Triangle& t = triangle[at];
    std::uint32_t side = 0;
    while (side < 3 && !separates(t, side)) ++side;
    if (side == 3) return {at, false};
    entered = t.mate[side];
  }
  std::uint32_t random = 0x9E3779B9u;
  while (true) {
    at = triangle_of(entered);
    const Triangle& t = triangle[at];
    if (has_ghost(t.corner)) return {at, true};
    random = random * 1664525u + 1013904223u;
    std::uint32_t first = next_index(index_of(entered));
    std::uint32_t second = previous_index(index_of(entered));
    if ((random >> 31) != 0) std::swap(first, second);
    if (separates(t, first)) {
      entered = t.mate[first];
    } else if (separates(t, second)) {
      entered = t.mate[second];
    } else {
      return {at, false};
    }
  }
}

/// The corner of a finite triangle that equals p, or kNone.
template <class Kernel>
std::uint32_t equal_corner(const Mesh<Kernel>& mesh, std::uint32_t t,
                           const typename Kernel::Point& p) {
  for (const std::uint32_t v : mesh.triangle[t].corner)
    if (same_point(mesh.point[v], p)) return v;
  return kNone;
}

}  // namespace terrace::tri::planar
