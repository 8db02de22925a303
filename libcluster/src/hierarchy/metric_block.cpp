// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/metric_block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <terrace/base/box.hpp>

#include "block/linear_block.hpp"
#include "facility/points/search_frame.hpp"
#include "hierarchy/outliers.hpp"

namespace terrace::cluster {
namespace {

// Each round removes outliers from the block. Nearly all blocks need only two.
constexpr int kRounds = 16;

// Drops the points that the clustering leaves out. Returns false if there were none.
bool drop_outliers(const BlockClustering& clustering, std::size_t channel_count,
                   std::vector<Point3>& points, std::vector<double>& channels,
                   std::vector<std::uint32_t>& numbers) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (clustering.assignment[i] == kOutlier) continue;
    points[kept] = points[i];
    numbers[kept] = numbers[i];
    std::copy_n(channels.begin() + static_cast<std::ptrdiff_t>(i * channel_count), channel_count,
                channels.begin() + static_cast<std::ptrdiff_t>(kept * channel_count));
    ++kept;
  }
  const bool dropped = kept < points.size();
  points.resize(kept);
  numbers.resize(kept);
  channels.resize(kept * channel_count);
  return dropped;
}

}  // namespace

void MetricBlockClusterer::run(const FacilityPoints& problem, const FacilityOptions& options,
                               BlockClustering& result) {
  run_once(problem, options, result);
  if (std::isinf(problem.outlier_price)) return;
  assert(problem.weights.empty());

  const std::size_t count = problem.points.size();
  points_.assign(problem.points.begin(), problem.points.end());
  channels_.assign(problem.channels.values.begin(), problem.channels.values.end());
  numbers_.resize(count);
  std::iota(numbers_.begin(), numbers_.end(), 0u);
  for (int round = 1; round < kRounds; ++round) {
    if (!drop_outliers(result, problem.channels.size(), points_, channels_, numbers_)) break;
    FacilityPoints rest = problem;
    rest.points = points_;
    rest.channels.values = channels_;
    if (round + 1 == kRounds) rest.outlier_price = std::numeric_limits<double>::infinity();
    run_once(rest, options, result);
  }
  if (numbers_.size() == count) return;

  // Converts the result back to the numbers of the block.
  for (std::uint32_t& facility : result.facilities) facility = numbers_[facility];
  std::vector<std::uint32_t> assignment(count, kOutlier);
  for (std::size_t i = 0; i < numbers_.size(); ++i) assignment[numbers_[i]] = result.assignment[i];
  result.assignment = std::move(assignment);
}

void MetricBlockClusterer::run_once(const FacilityPoints& problem, const FacilityOptions& options,
                                    BlockClustering& result) {
  const bool automatic = options.strategy == FacilityStrategy::automatic;
  if (automatic && problem.channels.size() == 0 &&
      linear_map(problem.metric, base::box_of(problem.points))) {
    run_linear(clusterer_, problem, {.effort = options.effort, .seed = options.seed}, result);
    leave_out(problem, result);
    return;
  }
  FacilityOptions search = options;
  search.assign_nearest = true;
  if (automatic && problem.points.size() < kFullSearchBelow) {
    search.effort = std::max(options.effort, Effort::fine);
  }
  FacilitySolution solution = solve(problem, search);
  result.facilities = std::move(solution.facilities);
  result.assignment = std::move(solution.assignment);
  result.facility_cost = result.connection_cost = 0.0;
}

}  // namespace terrace::cluster
