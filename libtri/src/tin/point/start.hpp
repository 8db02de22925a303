// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

/// Makes the first mesh of the frame's vertices alone. Throws as point_tin() does if the frame is
/// not a convex polygon.
void start_with_frame(Mesh& mesh, std::span<const Point3> frame);

/// Makes the first mesh of the corners of the samples' hull. Empty if all samples are collinear.
void start_with_hull(Mesh& mesh);

}  // namespace terrace::tri::tin::points
