// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::planar {

/// Triangulates mesh.hole, using only the polygon's vertices, and links the triangles to those
/// around it. Takes vertex.size() - 2 slots from the end of hole.slots. Neither the first nor the
/// last vertex may be the ghost.
///
/// The triangle at an edge has its apex where the edge is seen under the largest angle (its circle
/// is empty); it divides the polygon into two intervals of vertices, which are treated in the same
/// way. Exact, including perturbed ties. O(k log k) for k vertices if the parts are balanced,
/// O(k^2) at worst.
template <class Kernel>
void fill_hole(Mesh<Kernel>& mesh);

}  // namespace terrace::tri::planar
