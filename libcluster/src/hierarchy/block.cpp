// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include <terrace/base/random.hpp>

#include "ground.hpp"
#include "terrace/cluster/k_median.hpp"

namespace terrace::cluster {
namespace {

// Sets the weights to the counts of level-0 points, scaled to mean 1 (thesis 7.1.2).
void set_normalised_weights(std::span<const ClusterSummary> heads, std::vector<double>& weights) {
  std::uint64_t total = 0;
  for (const ClusterSummary& head : heads) total += head.descendants;
  const double scale = static_cast<double>(heads.size()) / static_cast<double>(total);
  weights.resize(heads.size());
  for (std::size_t i = 0; i < heads.size(); ++i) {
    weights[i] = static_cast<double>(heads[i].descendants) * scale;
  }
}

// If a block gets too many facilities, it is clustered again with four times the facility cost. The
// cost of the last attempt exceeds the sum of all weighted distances in any block.
constexpr int kAttempts = 20;
// Least cost after the first attempt. In a block of 10,000 points on a surface, it is too high for
// every point to have its own facility.
constexpr double kMinRaisedCost = 0x1p-8;
// With medians: how many representatives a full block keeps for each, at least, unless that is more
// than a quarter of its points. With fewer, the medians cost several per cent more.
constexpr std::size_t kKeptPerMedian = 25;
// The cost at which about a third of 10,000 points on a surface become facilities, and the number
// of attempts with a lower cost. Where points coincide, no cost gives more facilities.
constexpr double kCostOfAThird = 0x1p-7;
constexpr int kLowerCosts = 8;

/// Searches for a facility cost at which a block has from `least` to `most` facilities.
class CostSearch {
 public:
  CostSearch(double cost, std::size_t least, std::size_t most)
      : cost_(cost), least_(least), most_(most) {}

  [[nodiscard]] double cost() const { return cost_; }

  /// Returns whether the number of facilities at cost() is acceptable. If not, changes cost().
  [[nodiscard]] bool accepts(std::size_t count) {
    if (count <= most_ && (count >= least_ || lowered_ == kLowerCosts)) return true;
    if (count > most_) {
      too_low_ = cost_;
      cost_ = std::max(4.0 * cost_, kMinRaisedCost);
    } else {
      ++lowered_;
      too_high_ = cost_;
      // In the plane the number of clusters is proportional to cost^(-2/3).
      const double share = static_cast<double>(count) / static_cast<double>(least_);
      cost_ *= 0.5 * share * std::sqrt(share);
    }
    if (too_low_ > 0.0 && std::isfinite(too_high_)) {
      cost_ = std::sqrt(too_low_) * std::sqrt(too_high_);
    }
    return false;
  }

 private:
  double cost_;
  std::size_t least_, most_;
  double too_low_ = 0.0, too_high_ = std::numeric_limits<double>::infinity();
  int lowered_ = 0;
};

// Sorts the points by cluster (counting sort). Within each cluster they are in ascending order.
void group_by_cluster(const BlockClustering& clustering, std::vector<std::uint32_t>& first,
                      std::vector<std::uint32_t>& order) {
  const std::vector<std::uint32_t>& cluster_of = clustering.assignment;
  const std::size_t clusters = clustering.facilities.size();
  // At first, first[c + 2] counts the points of cluster c. After summing, first[c + 1] is the
  // position of its next point, and in the end that of the first point of the next cluster.
  first.assign(clusters + 2, 0);
  for (const std::uint32_t c : cluster_of) ++first[c + 2];
  for (std::size_t c = 2; c < first.size(); ++c) first[c] += first[c - 1];
  order.resize(cluster_of.size());
  for (std::uint32_t i = 0; i < cluster_of.size(); ++i) order[first[cluster_of[i] + 1]++] = i;
  first.pop_back();
}

// Clusters by number: cluster i consists of points 2 i and 2 i + 1.
void pair_up(std::size_t points, BlockClustering& clustering) {
  clustering.facilities.clear();
  for (std::uint32_t i = 0; i < points; i += 2) clustering.facilities.push_back(i);
  for (std::uint32_t i = 0; i < points; ++i) clustering.assignment[i] = i / 2;
}

}  // namespace

void HierarchyBlock::reset(unsigned new_level) {
  level = new_level;
  number = 0;
  outliers = 0;
  medians = 0;
  positions.clear();
  payload.clear();
  children.clear();
  heads.clear();
  prepared.reset();
}

void HierarchyBlock::append_representative(const HierarchyBlock& below, std::size_t c,
                                           std::uint64_t ordinal, std::size_t payload_size) {
  assert(level == below.level + 1);
  const std::size_t point = below.clustering.facilities[c];
  positions.push_back(below.positions[point]);
  const auto bytes = std::span(below.payload).subspan(point * payload_size, payload_size);
  payload.insert(payload.end(), bytes.begin(), bytes.end());
  const auto old = std::span(below.children).subspan(point * below.level, below.level);
  children.insert(children.end(), old.begin(), old.end());
  children.push_back(ordinal);
  heads.push_back(below.summaries[c]);
}

void HierarchyBlock::append_head(const ClusterHeads& from, std::size_t point,
                                 std::size_t payload_size) {
  assert(level == from.level);
  positions.push_back(from.positions[point]);
  const auto bytes = from.payload.subspan(point * payload_size, payload_size);
  payload.insert(payload.end(), bytes.begin(), bytes.end());
  const auto below = from.children.subspan(point * level, level);
  children.insert(children.end(), below.begin(), below.end());
  heads.push_back(from.summaries[point]);
}

ClusteredBlock HierarchyBlock::finished() const {
  return {level,    number, positions, payload, children, first, order, clustering.facilities,
          summaries};
}

std::uint64_t block_seed(std::uint64_t seed, unsigned level, std::uint64_t block) {
  return base::splitmix64(base::splitmix64(base::splitmix64(seed) ^ level) ^ block);
}

BlockProcessor::BlockProcessor(const HierarchyOptions& options, ClusterFunction cluster)
    : options_(options), cluster_(std::move(cluster)), metric_(options.metric) {
  if (options.metric_of || !std::holds_alternative<Euclidean>(options.metric) ||
      !options.channels.weights.empty() || options.strategy != FacilityStrategy::automatic ||
      std::isfinite(options.outlier_price)) {
    metric_cluster_.emplace(options.simd);
  }
}

void BlockProcessor::process(HierarchyBlock& block) {
  assert(block.size() > 0);
  const Box3 box = base::box_of(block.positions);
  const GroundMap map = options_.ground ? options_.ground(box) : kIdentityMap;
  check_ground_map(map, box, block.level, block.number);
  if (options_.metric_of) {
    metric_ = options_.metric_of(box);
    check(metric_);
  }
  if (options_.corners.count > 1) {
    read_corners(block, box.min, map);
    cluster(block, block.positions);
  } else if (map == kIdentityMap) {
    cluster(block, block.positions);
  } else {
    // Subtracts the minimum first, so that large offsets cost no digits in the product. That is not
    // possible if the metric depends on the position.
    const bool translation_invariant = !std::holds_alternative<EllipticalField>(metric_) &&
                                       !std::holds_alternative<CustomMetric>(metric_);
    ground_.resize(block.size());
    to_ground(block.positions, translation_invariant ? box.min : Point3{}, map, ground_);
    cluster(block, ground_);
  }
  group_by_cluster(block.clustering, block.first, block.order);

  const std::vector<std::uint32_t>& representatives = block.clustering.facilities;
  block.summaries.resize(representatives.size());
  for (std::size_t c = 0; c < representatives.size(); ++c) {
    const auto members =
        std::span(block.order).subspan(block.first[c], block.first[c + 1] - block.first[c]);
    block.summaries[c] =
        block.level == 0
            ? summarise_points(block.positions, members, representatives[c], map)
            : summarise_heads(block.positions, block.heads, members, representatives[c], map);
  }
}

void BlockProcessor::read_channels(const HierarchyBlock& block) {
  const std::size_t count = options_.channels.weights.size();
  channels_.resize(block.size() * count);
  if (count == 0) return;
  for (std::size_t i = 0; i < block.size(); ++i) {
    const auto values = std::span(channels_).subspan(i * count, count);
    options_.channels.read(
        std::span(block.payload).subspan(i * options_.payload_size, options_.payload_size), values);
    for (std::size_t c = 0; c < count; ++c) {
      if (std::isfinite(values[c])) continue;
      throw std::invalid_argument("channel " + std::to_string(c) + " of point " +
                                  std::to_string(i) + " in block " + std::to_string(block.number) +
                                  " of level " + std::to_string(block.level) + " is not finite");
    }
  }
}

void BlockProcessor::read_corners(const HierarchyBlock& block, const Point3& origin,
                                  const GroundMap& map) {
  const std::size_t count = options_.corners.count;
  corners_.resize(block.size() * count);
  for (std::size_t i = 0; i < block.size(); ++i) {
    const auto corners = std::span(corners_).subspan(i * count, count);
    corners[0] = block.positions[i];
    options_.corners.read(
        std::span(block.payload).subspan(i * options_.payload_size, options_.payload_size),
        corners);
  }
  if (const std::size_t bad = first_not_finite(corners_); bad < corners_.size()) {
    throw std::invalid_argument("corner " + std::to_string(bad % count) + " of entity " +
                                std::to_string(bad / count) + " in block " +
                                std::to_string(block.number) + " of level " +
                                std::to_string(block.level) + " is not finite");
  }
  if (map == kIdentityMap) return;
  check_ground_map(map, base::box_of(corners_), block.level, block.number);
  to_ground(corners_, origin, map, corners_);
}

// If a block has fewer points, they are farther apart relative to its diagonal. On a surface the
// factor is the square root of the ratio.
double BlockProcessor::outlier_price(const HierarchyBlock& block) const {
  if (block.level > 0) return std::numeric_limits<double>::infinity();
  return options_.outlier_price *
         std::sqrt(static_cast<double>(options_.block_size) / static_cast<double>(block.size()));
}

void BlockProcessor::cluster(HierarchyBlock& block, std::span<const Point3> ground) {
  weights_.clear();
  if (block.level > 0) set_normalised_weights(block.heads, weights_);
  read_channels(block);
  if (block.medians > 0) {
    find_medians(block, ground);
    return;
  }
  double cost = options_.block.facility_cost;
  std::size_t least = 0;
  if (options_.medians > 0) {
    const double share = std::min(0.25, static_cast<double>(kKeptPerMedian * options_.medians) /
                                            static_cast<double>(options_.block_size));
    least = static_cast<std::size_t>(share * static_cast<double>(block.size()));
    const double thirds = 0.25 / share;
    cost = kCostOfAThird * thirds * std::sqrt(thirds);
  }
  CostSearch search(cost, least, (block.size() + 1) / 2);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    cluster_at(search.cost(), block, ground);
    assert(block.clustering.assignment.size() == block.size());
    if (search.accepts(block.clustering.facilities.size())) {
      if (std::isfinite(options_.outlier_price)) place_outliers(block, ground);
      return;
    }
  }
  pair_up(block.size(), block.clustering);
}

void BlockProcessor::cluster_at(double facility_cost, HierarchyBlock& block,
                                std::span<const Point3> ground) {
  BlockOptions options = options_.block;
  options.facility_cost = facility_cost;
  options.seed = block_seed(options_.block.seed, block.level, block.number);
  const FacilityOptions search{
      .strategy = options_.strategy,
      .effort = options.effort,
      .seed = options.seed,
      .threads = options_.search_threads,
      .batch = options_.batch,
      .progress = [this](std::size_t, std::size_t) { return !options_.stop.stop_requested(); }};
  if (options_.corners.count > 1) {
    entity_cluster_.run(corners_, options_.corners.count, options_.corners.ordered,
                        {channels_, options_.channels.weights}, weights_, facility_cost, search,
                        block.clustering);
  } else if (metric_cluster_) {
    metric_cluster_->run({.points = ground,
                          .weights = weights_,
                          .metric = metric_,
                          .channels = {channels_, options_.channels.weights},
                          .facility_cost = facility_cost,
                          .outlier_price = outlier_price(block)},
                         search, block.clustering);
  } else {
    cluster_(ground, weights_, options, block.clustering);
  }
}

void BlockProcessor::find_medians(HierarchyBlock& block, std::span<const Point3> ground) {
  struct Stopped {};
  const auto check_stop = [this] {
    if (options_.stop.stop_requested()) throw Stopped();
  };
  try {
    FacilitySolution solution =
        k_median({.points = ground,
                  .weights = weights_,
                  .metric = metric_,
                  .channels = {channels_, options_.channels.weights}},
                 block.medians,
                 {.restarts = 1,
                  .bound_steps = 0,
                  .seed = block_seed(options_.block.seed, block.level, block.number),
                  .threads = options_.threads,
                  .check_stop = check_stop});
    block.clustering.facilities = std::move(solution.facilities);
    block.clustering.assignment = std::move(solution.assignment);
  } catch (const Stopped&) {
    // The work is abandoned, so any clusters will do.
    block.clustering.assignment.resize(block.size());
    pair_up(block.size(), block.clustering);
  }
}

// Makes each outlier a marked member of the cluster with the nearest representative.
void BlockProcessor::place_outliers(HierarchyBlock& block, std::span<const Point3> ground) {
  BlockClustering& clustering = block.clustering;
  for (std::size_t i = 0; i < block.size(); ++i) {
    if (clustering.assignment[i] != kOutlier) continue;
    ++block.outliers;
    options_.mark_outlier(
        std::span(block.payload).subspan(i * options_.payload_size, options_.payload_size));
    double least = std::numeric_limits<double>::infinity();
    clustering.assignment[i] = 0;
    for (std::uint32_t c = 0; c < clustering.facilities.size(); ++c) {
      const double d = distance(metric_, ground[clustering.facilities[c]], ground[i]);
      if (!(d < least)) continue;
      least = d;
      clustering.assignment[i] = c;
    }
  }
}

}  // namespace terrace::cluster
