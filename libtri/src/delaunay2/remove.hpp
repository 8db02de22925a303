// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Removes a vertex and fills the hole of its triangles.
template <class Kernel>
void remove_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex);

/// Removes a set of different vertices, see remove_set.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// True if the finite vertices are collinear; a ghost among them is skipped.
template <class Kernel>
bool collinear(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Rotates the hole so that neither its first nor its last vertex is the ghost.
template <class Point>
void turn_ghost_inside(Hole<Point>& hole);

/// Triangulates mesh.hole, using only the polygon's vertices, and links the triangles to those
/// around it. Takes vertex.size() - 2 slots from the end of hole.slots. Neither the first nor the
/// last vertex may be the ghost.
///
/// The apex of the triangle at an edge is the vertex that sees the edge under the largest angle, so
/// its circle is empty. The triangle divides the polygon into two intervals of vertices, which are
/// treated in the same way. Exact, including perturbed ties. O(k log k) for k vertices if the parts
/// are balanced, O(k^2) at worst.
template <class Kernel>
void fill_hole(Mesh<Kernel>& mesh);

}  // namespace terrace::tri::planar
