// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Triangulates mesh.hole, whose triangles use the polygon's vertices only, and links it to what
/// lies around. vertex.size() - 2 slots are taken from the end of hole.slots. Neither the first nor
/// the last vertex is the ghost.
///
/// The triangle at an edge has its apex where the edge is seen under the largest angle (its circle
/// is empty); it parts the polygon into two intervals of vertices, which are treated alike. Exact,
/// perturbed ties included. O(k log k) for k vertices where the parts are balanced, O(k^2) at
/// worst.
template <class Kernel>
void fill_hole(Mesh<Kernel>& mesh);

}  // namespace terrace::tri::planar
