// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/point_mesh_plan.hpp"
#include "mesh/bounded/point_mesh_sides.hpp"
#include "mesh/bounded/point_mesh_window.hpp"

namespace terrace::terrain {

/// Makes one mesh of the meshes of a plan's windows. Memory: 4 bytes per knot and per vertex of the
/// sides between windows that are in the mesh and windows that are not yet.
class PointMeshJoiner {
 public:
  /// Sides that no window needs any more are dropped.
  PointMeshJoiner(const PointMeshPlan& plan, PointMeshSides& sides, MeshSpool& spool);

  /// Adds window i; windows come in order.
  void add(std::size_t i, const PointWindowTin& tin);

 private:
  const PointMeshPlan& plan_;
  PointMeshSides& sides_;
  MeshSpool& spool_;
  std::vector<std::uint32_t> knots_;  ///< numbers of vertices
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> open_sides_;
};

}  // namespace terrace::terrain
