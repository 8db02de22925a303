// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"

/// The operations of a triangulation besides insertion. Their sources are build.cpp, grid.cpp,
/// fill.cpp, remove.cpp, remove_set.cpp and query.cpp.

namespace terrace::tri::planar {

/// Builds a triangulation in an empty mesh, see build.cpp. Returns the vertex of each point.
template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points);

/// Writes a complete grid into an empty mesh. xs, ys: coordinates of columns and rows, ascending by
/// the same step. Returns the first vertex.
template <class Kernel>
std::uint32_t build_grid(Mesh<Kernel>& mesh, std::span<const typename Kernel::Coord> xs,
                         std::span<const typename Kernel::Coord> ys);

/// Removes a vertex and fills the hole of its triangles.
template <class Kernel>
void remove_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex);

/// Removes a set of different vertices, see remove_set.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// True if the finite vertices are collinear. A ghost among them is skipped.
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

/// Implements Delaunay2::locate(), nearest(), adjacent() and hash().
template <class Kernel>
Location locate(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);
template <class Kernel>
std::uint32_t nearest(const Mesh<Kernel>& mesh, const typename Kernel::Point& p,
                      std::uint32_t hint);
template <class Kernel>
void adjacent(const Mesh<Kernel>& mesh, std::uint32_t vertex, std::vector<VertexId>& result);
/// Number of triangles at a vertex, including ghosts.
template <class Kernel>
std::uint32_t degree(const Mesh<Kernel>& mesh, std::uint32_t vertex);
template <class Kernel>
std::uint64_t hash(const Mesh<Kernel>& mesh);

}  // namespace terrace::tri::planar
