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

}  // namespace terrace::tri::planar
