// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri::planar {

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
