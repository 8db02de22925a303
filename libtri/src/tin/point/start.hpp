// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

/// The first mesh: only the frame's vertices. Throws as point_tin() does if it is not a convex
/// polygon.
void start_with_frame(Mesh& mesh, std::span<const Point3> frame);

/// The first mesh: the corners of the samples' hull. Empty if all samples are on one line.
void start_with_hull(Mesh& mesh);

}  // namespace terrace::tri::tin::points
