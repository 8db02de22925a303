// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/metric_block.hpp"

#include <utility>

#include "block/linear_block.hpp"
#include "facility/search_frame.hpp"
#include "terrace/cluster/point_search.hpp"

namespace terrace::cluster {
namespace {

SearchLength length_of(Effort effort, std::size_t count) {
  if (effort == Effort::full) return SearchLength::log2_full;
  if (effort == Effort::fine || count < kFullSearchBelow) return SearchLength::log10_full;
  return SearchLength::tenth;
}

}  // namespace

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
  FacilitySolution solution =
      search_points(problem, {.length = length_of(options.effort, points.size()),
                              .seed = options.seed,
                              .assign_nearest = true});
  result.facilities = std::move(solution.facilities);
  result.assignment = std::move(solution.assignment);
  result.facility_cost = result.connection_cost = 0.0;
}

}  // namespace terrace::cluster
