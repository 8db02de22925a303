// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_plan.hpp"
#include "mesh/bounded/point_mesh_samples.hpp"

namespace terrace::terrain {

/// A vertex on a side: its place along it and its height.
struct SideVertex {
  double at = 0.0, height = 0.0;
};
using SideVertices = std::vector<SideVertex>;

/// What lies on the sides of the windows, settled before the windows are meshed: the Delaunay
/// triangulation of the samples close to a side, cut along it, within a share of the bound. It
/// depends on these samples alone, so both windows at a side have the same vertices there. May be
/// used by several threads at once.
class PointMeshSides {
 public:
  /// max_error: of the mesh, in the unit of heights.
  PointMeshSides(const PointMeshPlan& plan, PointMeshSamples& samples,
                 tri::PointDuplicates duplicates, double max_error);

  /// The vertices of a side, its knots included, ascending. Kept until drop().
  std::shared_ptr<const SideVertices> vertices(std::uint32_t side);
  void drop(std::uint32_t side);

 private:
  [[nodiscard]] SideVertices settle(const PointMeshPlan::Side& side);
  [[nodiscard]] MeshSamples near_side(const PointMeshPlan::Side& side) const;
  [[nodiscard]] double height_at(std::uint32_t knot);
  [[nodiscard]] double settle_knot(std::uint32_t knot) const;

  const PointMeshPlan& plan_;
  PointMeshSamples& samples_;
  tri::PointDuplicates duplicates_;
  double side_error_;
  std::vector<std::vector<std::uint32_t>> windows_at_;  ///< per knot
  std::mutex mutex_;
  std::vector<std::shared_ptr<const SideVertices>> known_;
  std::vector<std::optional<double>> heights_;  ///< of knots
};

}  // namespace terrace::terrain
