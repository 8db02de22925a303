// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {

/// Leaves points out of a clustering made without regard to problem.outlier_price, where that
/// lowers the cost. This affects members farther from their facility than the price, and whole
/// clusters that cost more than their members would pay elsewhere or for being left out. Such
/// members are assigned to kOutlier. The other members of such a cluster go to the nearest
/// remaining facility. `facilities` keeps the facilities without a cluster, and at least one
/// facility keeps its cluster.
///
/// Requires a metric that is linear on the bounding box of the points, without weights and
/// channels. Does nothing if there is no price. Takes O(n), and O(k) for each member of a cluster
/// that is small enough to be worth less than its facility.
void leave_out(const FacilityPoints& problem, BlockClustering& clustering);

/// Clusters the blocks of a hierarchy under any metric, with channels and outliers. Uses
/// BlockClusterer if that is possible and no other strategy is requested, otherwise solve(). One
/// object per thread.
class MetricBlockClusterer {
 public:
  explicit MetricBlockClusterer(SimdPath path) : clusterer_(path) {}

  /// problem: points on the ground. Its costs are multiples of the diagonal of the points that are
  /// not left out. Weights must be empty if it has an outlier price. Points left out are assigned
  /// to kOutlier. The costs in `result` are not filled in.
  /// Throws: std::invalid_argument as solve() does.
  void run(const FacilityPoints& problem, const FacilityOptions& options, BlockClustering& result);

 private:
  void run_once(const FacilityPoints& problem, const FacilityOptions& options,
                BlockClustering& result);

  BlockClusterer clusterer_;
  std::vector<Point3> points_;  // the points that are not left out
  std::vector<double> channels_;
  std::vector<std::uint32_t> numbers_;  // for each of points_, its number in the block
};

}  // namespace terrace::cluster
