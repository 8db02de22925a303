// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_cuts.hpp"
#include "mesh/bounded/point_mesh_samples.hpp"

namespace terrace::terrain {

/// Tells about how many vertices a mesh will have, from the samples in the middle of cells. May be
/// used by several threads at once.
class PointMeshEstimate {
 public:
  PointMeshEstimate(const PointMeshCuts& cuts, PointMeshSamples& samples,
                    tri::PointDuplicates duplicates);

  /// Vertices of a cell's mesh by greedy insertion. max_error: in the unit of heights.
  [[nodiscard]] double in_cell(std::uint32_t cell, double max_error) const;
  /// The average over all cells, estimated from four of them.
  [[nodiscard]] double per_cell(double max_error) const;

 private:
  const PointMeshCuts& cuts_;
  PointMeshSamples& samples_;
  tri::PointTinOptions options_;
};

}  // namespace terrace::terrain
