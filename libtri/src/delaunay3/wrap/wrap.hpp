// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "delaunay3/hole_filling.hpp"
#include "delaunay3/mesh.hpp"

namespace terrace::tri::spatial {

/// Fills mesh.hole, of which at least one facet is finite and whose vertices are not all vertices
/// of a plane, see wrap.cpp. Vertices at it get tetrahedra; slots left over are freed.
template <class Kernel>
void wrap_hole(Mesh<Kernel>& mesh);

/// The same for what another way of filling has left open.
template <class Kernel>
void wrap_rest(Mesh<Kernel>& mesh, HoleFilling<Kernel>& filling);

}  // namespace terrace::tri::spatial
