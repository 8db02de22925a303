// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Clusters the blocks of a hierarchy whose points represent entities of several corners. One
/// object per thread.
class EntityBlockClusterer {
 public:
  /// corners: in ground coordinates, `count` consecutive ones for each entity. ordered: as in
  /// PayloadCorners. weights: one per entity. facility_cost: a multiple of the diagonal of the
  /// bounding box of all corners. The automatic strategy searches small blocks with at least
  /// Effort::fine. Sets the costs in `result` to 0.
  /// Throws: std::invalid_argument as solve(FacilityEntities) does.
  void run(std::span<const Point3> corners, std::size_t count, bool ordered,
           std::span<const double> weights, double facility_cost, const FacilityOptions& options,
           BlockClustering& result);

 private:
  std::vector<Point3> scaled_;
};

}  // namespace terrace::cluster
