// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/metric_block.hpp"

#include <algorithm>
#include <utility>

#include "block/linear_block.hpp"
#include "facility/points/search_frame.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

MetricBlockClusterer::MetricBlockClusterer(std::vector<double> channel_weights, SimdPath path)
    : channel_weights_(std::move(channel_weights)), clusterer_(path) {}

void MetricBlockClusterer::run(const Metric& metric, std::span<const Point3> points,
                               std::span<const double> weights, std::span<const double> channels,
                               const BlockOptions& options, BlockClustering& result) {
  const FacilityPoints problem{.points = points,
                               .weights = weights,
                               .metric = metric,
                               .channels = {channels, channel_weights_},
                               .facility_cost = options.facility_cost};
  if (channel_weights_.empty() && linear_map(metric, bounds_of(points))) {
    run_linear(clusterer_, problem, options.effort, options.seed, result);
    return;
  }
  const Effort effort =
      points.size() < kFullSearchBelow ? std::max(options.effort, Effort::fine) : options.effort;
  FacilitySolution solution =
      solve(problem, {.effort = effort, .seed = options.seed, .assign_nearest = true});
  result.facilities = std::move(solution.facilities);
  result.assignment = std::move(solution.assignment);
  result.facility_cost = result.connection_cost = 0.0;
}

}  // namespace terrace::cluster
