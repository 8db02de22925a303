// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri::planar {

/// Builds a triangulation in an empty mesh, see build.cpp. Returns the vertex of each point.
template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points);

/// Writes a complete grid into an empty mesh. xs, ys: coordinates of columns and rows, ascending by
/// the same step. Returns the first vertex.
template <class Kernel>
std::uint32_t build_grid(Mesh<Kernel>& mesh, std::span<const typename Kernel::Coord> xs,
                         std::span<const typename Kernel::Coord> ys);

}  // namespace terrace::tri::planar
