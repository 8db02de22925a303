// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mesh/bounded/point_mesh_window.hpp"

namespace terrace::terrain {

/// The border of a window, counter-clockwise: what is settled on its sides inside the hull, and
/// along the hull its corners and the samples on it that the bound asks for.
struct PointMeshFrame {
  std::vector<tri::Point3> vertices;
  std::vector<PointWindowTin::Shared> shared;  ///< in parallel
};

/// sides: the vertices of window.sides, in parallel.
PointMeshFrame frame_of(const PointMeshPlan& plan, const PointMeshPlan::Window& window,
                        const std::vector<std::shared_ptr<const SideVertices>>& sides,
                        const MeshSamples& samples, const tri::PointTinOptions& options);

}  // namespace terrace::terrain
