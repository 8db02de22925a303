// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Removes a vertex: the hole of its triangles is filled again.
template <class Kernel>
void remove_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex);

/// Removes a set of different vertices, see remove_set.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Whether finite vertices (a ghost among them is skipped) lie on one line.
template <class Kernel>
bool collinear(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Rotates the hole so that neither its first nor its last vertex is the ghost.
template <class Point>
void turn_ghost_inside(Hole<Point>& hole);

}  // namespace terrace::tri::planar
