// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/block_clusterers.hpp"

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
#include <terrace/base/portable_math.hpp>

#include "block/linear_block.hpp"
#include "facility/corner_distance.hpp"
#include "facility/points/channel_axis.hpp"
#include "facility/points/search_frame.hpp"
#include "ground.hpp"
#include "scaling.hpp"

namespace terrace::cluster {
namespace {

// Each round removes outliers from the block. Nearly all blocks need only two.
constexpr int kRounds = 16;

// Removes the outliers of the clustering from the points. Returns false if there are none.
bool drop_outliers(const BlockClustering& clustering, std::size_t channel_count,
                   std::vector<Point3>& points, std::vector<double>& channels,
                   std::vector<std::uint32_t>& numbers) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (clustering.assignment[i] == kOutlier) continue;
    points[count] = points[i];
    numbers[count] = numbers[i];
    std::copy_n(channels.begin() + static_cast<std::ptrdiff_t>(i * channel_count), channel_count,
                channels.begin() + static_cast<std::ptrdiff_t>(count * channel_count));
    ++count;
  }
  const bool dropped = count < points.size();
  points.resize(count);
  numbers.resize(count);
  channels.resize(count * channel_count);
  return dropped;
}

}  // namespace

void assign_outliers(const FacilityPoints& problem, BlockClustering& clustering) {
  if (std::isinf(problem.outlier_price)) return;
  const SearchFrame frame = make_frame(problem);
  const double weight = frame.weights.front();  // all weights are equal
  const double price = frame.outlier_price;
  const double facility_cost = frame.facility_cost / weight;
  const std::vector<std::uint32_t>& facilities = clustering.facilities;
  const auto distance_to = [&](std::size_t i, std::size_t cluster) {
    return std::sqrt(
        squared_length(difference(frame.points[i], frame.points[facilities[cluster]])));
  };

  std::vector<std::uint32_t> sizes(facilities.size(), 0);
  std::vector<double> cluster_cost(facilities.size(), facility_cost);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    const double d = distance_to(i, c);
    ++sizes[c];
    cluster_cost[c] += std::min(d, price);
    if (d > price) clustering.assignment[i] = kOutlier;
  }

  // Clusters that cost more than making all their members outliers, smallest first.
  std::vector<std::uint32_t> candidates;
  std::vector<char> is_candidate(facilities.size(), 0);
  for (std::uint32_t c = 0; c < facilities.size(); ++c) {
    if (!(sizes[c] * price < cluster_cost[c])) continue;
    candidates.push_back(c);
    is_candidate[c] = 1;
  }
  if (candidates.empty()) return;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] < sizes[b]; });
  std::vector<std::vector<std::uint32_t>> members(facilities.size());  // of the candidates
  for (std::uint32_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    if (c != kOutlier && is_candidate[c]) members[c].push_back(i);
  }

  struct Alternative {
    std::uint32_t cluster;
    double cost;
  };
  std::vector<Alternative> moves;
  std::vector<char> closed(facilities.size(), 0);
  std::size_t open_count = facilities.size();
  for (const std::uint32_t c : candidates) {
    if (open_count == 1) break;
    moves.clear();
    double dissolved_cost = static_cast<double>(sizes[c] - members[c].size()) * price;
    bool has_outlier = false;
    for (const std::uint32_t i : members[c]) {
      Alternative best{kOutlier, price};
      for (std::uint32_t other = 0; other < facilities.size(); ++other) {
        if (other == c || closed[other]) continue;
        if (const double d = distance_to(i, other); d < best.cost) best = {other, d};
      }
      moves.push_back(best);
      dissolved_cost += best.cost;
      has_outlier = has_outlier || best.cluster == kOutlier;
    }
    if (!has_outlier || !(dissolved_cost < cluster_cost[c])) continue;
    closed[c] = 1;
    --open_count;
    for (std::size_t k = 0; k < moves.size(); ++k) {
      const auto [target, cost] = moves[k];
      clustering.assignment[members[c][k]] = target;
      if (target == kOutlier) continue;
      ++sizes[target];
      cluster_cost[target] += cost;
      if (is_candidate[target]) members[target].push_back(members[c][k]);
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
    FacilityPoints remainder = problem;
    remainder.points = points_;
    remainder.channels.values = channels_;
    if (round + 1 == kRounds) remainder.outlier_price = std::numeric_limits<double>::infinity();
    run_once(remainder, options, result);
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
    assign_outliers(problem, result);
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

double EntityBlockClusterer::scale(std::span<const Point3> corners, const Channels& channels,
                                   std::size_t entities) {
  const Scaling scaling(corners);
  int greatest = scaling.diagonal > 0.0 ? scaling.exponent : std::numeric_limits<int>::min();
  std::vector<ChannelAxis> axes;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    axes.emplace_back(channels, c, entities);
    greatest = std::max(greatest, axes.back().exponent);
  }
  const int shift = scaling.diagonal > 0.0 ? scaling.exponent - greatest : 0;
  scaled_.resize(corners.size());
  std::transform(corners.begin(), corners.end(), scaled_.begin(), [&](const Point3& p) {
    Point3 scaled = scaling.scaled(p);
    if (shift != 0) {
      for (double& x : scaled) x = std::ldexp(x, shift);
    }
    return scaled;
  });
  double diagonal = std::ldexp(scaling.diagonal, shift);
  scaled_channels_.assign(entities * axes.size(), 0.0);
  for (std::size_t c = 0; c < axes.size(); ++c) {
    const ChannelAxis& axis = axes[c];
    if (axis.weight == 0.0) continue;
    diagonal = base::hypot(diagonal, std::ldexp(axis.range, axis.exponent - greatest));
    for (std::size_t k = c; k < scaled_channels_.size(); k += axes.size()) {
      scaled_channels_[k] = std::ldexp(axis.value(channels.values[k]), axis.exponent - greatest);
    }
  }
  return diagonal;
}

void EntityBlockClusterer::run(std::span<const Point3> corners, std::size_t count, bool ordered,
                               const Channels& channels, std::span<const double> weights,
                               double facility_cost, const FacilityOptions& options,
                               BlockClustering& result) {
  assert(count > 1 && corners.size() % count == 0);
  const double diagonal = scale(corners, channels, corners.size() / count);
  const std::size_t axes = channels.size();

  FacilityEntities problem;
  problem.count = corners.size() / count;
  problem.distance = [this, count, ordered, axes](std::uint32_t facility, std::uint32_t client) {
    const Point3* const a = scaled_.data() + facility * count;
    const Point3* const b = scaled_.data() + client * count;
    const double moved = corner_distance(count, ordered, [a, b](std::size_t i, std::size_t j) {
      return squared_length(difference(a[i], b[j]));
    });
    if (axes == 0) return moved;
    // The Euclidean combination of metrics is a metric.
    double squares = moved * moved;
    for (std::size_t c = 0; c < axes; ++c) {
      const double d = scaled_channels_[facility * axes + c] - scaled_channels_[client * axes + c];
      squares += d * d;
    }
    return std::sqrt(squares);
  };
  problem.symmetric = problem.triangle_inequality = true;
  problem.weights = weights;
  // If all entities are equal any cost works, but it must be positive.
  problem.facility_cost =
      std::clamp(facility_cost * diagonal, std::numeric_limits<double>::min(), 0x1p1000);
  FacilityOptions search = options;
  search.assign_nearest = true;
  if (options.strategy == FacilityStrategy::automatic && problem.count < kFullSearchBelow) {
    search.effort = std::max(options.effort, Effort::fine);
  }
  FacilitySolution solution = solve(problem, search);
  result.facilities = std::move(solution.facilities);
  result.assignment = std::move(solution.assignment);
  result.facility_cost = result.connection_cost = 0.0;
}

}  // namespace terrace::cluster
