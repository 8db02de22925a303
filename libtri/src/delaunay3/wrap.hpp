// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// Fills mesh.hole, of which at least one facet is finite and whose vertices are not all vertices
/// of a plane, see wrap.cpp. Vertices at it get tetrahedra; slots left over are freed.
template <class Kernel>
void wrap_hole(Mesh<Kernel>& mesh);

}  // namespace terrace::tri::spatial
