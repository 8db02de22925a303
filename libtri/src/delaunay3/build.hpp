// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"

namespace terrace::tri::spatial {

/// Builds a triangulation in an empty mesh, see build.cpp. Returns the vertex of each point.
template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                            unsigned threads);

}  // namespace terrace::tri::spatial
