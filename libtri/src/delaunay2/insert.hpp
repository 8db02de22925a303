// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Joins a vertex, which has its slot and point but no triangle, to a triangulation with triangles.
/// `conflict`: a triangle in conflict with it, as walk() finds where no corner equals the point.
///
/// Bowyer and Watson's cavity, traversed depth-first across edges. It contains no vertex, so the
/// traversal is a tree and needs no marks, and it meets the cavity's boundary in counter-clockwise
/// order, so each new triangle is linked to the one before. About 4.2 triangles are replaced.
template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict);

/// Inserts a point, or finds the vertex that equals it. `hint`: a living vertex, or kNone.
struct Inserted {
  std::uint32_t vertex;
  bool created;
};
template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);

}  // namespace terrace::tri::planar
