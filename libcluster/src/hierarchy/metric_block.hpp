// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {

/// Clusters the blocks of a hierarchy under any metric and with channels: as BlockClusterer where
/// that is possible, else by local search. One object per thread.
class MetricBlockClusterer {
 public:
  MetricBlockClusterer(std::vector<double> channel_weights, SimdPath path);

  /// points: on the ground. channels: row by row. The costs in `result` are not filled in.
  /// Throws: std::invalid_argument on a distance of a custom metric that is negative or not finite.
  void run(const Metric& metric, std::span<const Point3> points, std::span<const double> weights,
           std::span<const double> channels, const BlockOptions& options, BlockClustering& result);

 private:
  std::vector<double> channel_weights_;
  BlockClusterer clusterer_;
};

}  // namespace terrace::cluster
