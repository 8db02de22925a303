// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/metric_block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <terrace/base/box.hpp>

#include "block/linear_block.hpp"
#include "facility/points/search_frame.hpp"
#include "ground.hpp"

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

void leave_out(const FacilityPoints& problem, BlockClustering& clustering) {
  if (std::isinf(problem.outlier_price)) return;
  const SearchFrame frame = make_frame(problem);
  const double weight = frame.weights.front();  // all weights are equal
  const double price = frame.outlier_price;
  const double facility_cost = frame.facility_cost / weight;
  const std::vector<std::uint32_t>& facilities = clustering.facilities;
  const auto between = [&](std::size_t i, std::size_t cluster) {
    return std::sqrt(
        squared_length(difference(frame.points[i], frame.points[facilities[cluster]])));
  };

  std::vector<std::uint32_t> sizes(facilities.size(), 0);
  std::vector<double> spent(facilities.size(), facility_cost);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    const double d = between(i, c);
    ++sizes[c];
    spent[c] += std::min(d, price);
    if (d > price) clustering.assignment[i] = kOutlier;
  }

  // Clusters that cost more than leaving out all their members, smallest first.
  std::vector<std::uint32_t> doubtful;
  std::vector<char> listed(facilities.size(), 0);
  for (std::uint32_t c = 0; c < facilities.size(); ++c) {
    if (!(sizes[c] * price < spent[c])) continue;
    doubtful.push_back(c);
    listed[c] = 1;
  }
  if (doubtful.empty()) return;
  std::stable_sort(doubtful.begin(), doubtful.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] < sizes[b]; });
  std::vector<std::vector<std::uint32_t>> members(facilities.size());  // of listed clusters
  for (std::uint32_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    if (c != kOutlier && listed[c]) members[c].push_back(i);
  }

  struct Elsewhere {
    std::uint32_t cluster;
    double cost;
  };
  std::vector<Elsewhere> moves;
  std::vector<char> closed(facilities.size(), 0);
  std::size_t open = facilities.size();
  for (const std::uint32_t c : doubtful) {
    if (open == 1) break;
    moves.clear();
    double without = static_cast<double>(sizes[c] - members[c].size()) * price;
    bool leaves = false;
    for (const std::uint32_t i : members[c]) {
      Elsewhere best{kOutlier, price};
      for (std::uint32_t other = 0; other < facilities.size(); ++other) {
        if (other == c || closed[other]) continue;
        if (const double d = between(i, other); d < best.cost) best = {other, d};
      }
      moves.push_back(best);
      without += best.cost;
      leaves = leaves || best.cluster == kOutlier;
    }
    if (!leaves || !(without < spent[c])) continue;
    closed[c] = 1;
    --open;
    for (std::size_t k = 0; k < moves.size(); ++k) {
      const auto [to, cost] = moves[k];
      clustering.assignment[members[c][k]] = to;
      if (to == kOutlier) continue;
      ++sizes[to];
      spent[to] += cost;
      if (listed[to]) members[to].push_back(members[c][k]);
    }
  }
}

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
