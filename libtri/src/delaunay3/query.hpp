// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"

namespace terrace::tri::spatial {

/// Implements Delaunay3::locate(), nearest(), adjacent(), tetrahedra_at() and hash().
template <class Kernel>
Location3 locate(const Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);
template <class Kernel>
std::uint32_t nearest(const Mesh<Kernel>& mesh, const typename Kernel::Point& p,
                      std::uint32_t hint);
template <class Kernel>
void adjacent(const Mesh<Kernel>& mesh, std::uint32_t vertex, std::vector<VertexId>& result);
template <class Kernel>
void tetrahedra_at(const Mesh<Kernel>& mesh, std::uint32_t vertex,
                   std::vector<TetrahedronId>& result);
template <class Kernel>
std::uint64_t hash(const Mesh<Kernel>& mesh);

}  // namespace terrace::tri::spatial
