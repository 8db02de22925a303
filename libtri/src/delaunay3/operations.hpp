// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "delaunay3/wrap/wrap.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"

/// The operations of a triangulation besides insertion. Their sources are build.cpp, remove.cpp and
/// query.cpp.

namespace terrace::tri::spatial {

/// Builds a triangulation in an empty mesh, see build.cpp. Returns the vertex of each point.
template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                            unsigned threads);

/// Fills mesh.hole, like wrap_hole().
template <class Kernel>
using FillHole = void (*)(Mesh<Kernel>& mesh);

/// Removes one or many different vertices, see remove.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices,
                FillHole<Kernel> fill = wrap_hole<Kernel>);

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
