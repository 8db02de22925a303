// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "predicates.hpp"

namespace terrace::tri::spatial {

/// The end of a walk.
struct WalkEnd {
  /// The finite tetrahedron that contains the point, including its boundary, or the ghost beyond a
  /// hull facet that the point sees. kNone if the walk left the readable part.
  std::uint32_t tetrahedron = kNone;
  bool outside = false;
};

/// Allows reading all tetrahedra.
struct Everywhere {
  static constexpr bool kIsEntireMesh = true;
};

/// Remembering visibility walk: goes from tetrahedron to tetrahedron through the first facet that
/// separates the current one from p, and never tests the facet just crossed. The walk cannot cycle
/// in a (perturbed) Delaunay triangulation. `start` may be a ghost. `part`: see
/// parallel_insert.cpp.
template <class Kernel, class Part = Everywhere>
WalkEnd walk(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t start,
             const Part& part = {}) {
  const auto* const vertex = mesh.vertex.data();
  const Tetrahedron* const tetrahedron = mesh.tetrahedron.data();
  std::uint32_t at = mesh.finite_side(start);
  std::uint32_t entered = 4;
  while (true) {
    const Tetrahedron& t = tetrahedron[at];
    Side next = 0;
    std::uint32_t i = 0;
    for (; i < 4; ++i) {
      if (i == entered || orientation_with<Kernel>(vertex, t, i, p) >= 0) continue;
      next = t.mate[i];
      break;
    }
    if (i == 4) return {at, false};
    if constexpr (!Part::kIsEntireMesh) {
      if (!part.may_read_beyond(t, i)) return {kNone, false};
    }
    at = tetrahedron_of(next);
    entered = index_of(next);
    if (tetrahedron[at].corner[entered] == kGhost) return {at, true};
  }
}

/// The corner of a finite tetrahedron that equals p, or kNone.
template <class Kernel>
std::uint32_t equal_corner(const Mesh<Kernel>& mesh, std::uint32_t t,
                           const typename Kernel::Point& p) {
  for (const std::uint32_t v : mesh.tetrahedron[t].corner)
    if (same_point(mesh.vertex[v].point, p)) return v;
  return kNone;
}

}  // namespace terrace::tri::spatial
