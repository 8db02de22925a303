// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_means.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>
#include <terrace/base/thread_team.hpp>

#include "k_means/filter.hpp"
#include "k_means/tree.hpp"
#include "scaling.hpp"
#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {
namespace {

// Squared distance below which a point counts as being at its centre, in the unit of the bounding
// box. Not zero, because the mean of many points is rounded.
constexpr double kAtCentre2 = 0x1p-72;
// Limit of the caller's coordinates in the same unit. Beyond it squares would overflow.
constexpr double kFarthest = 0x1p+400;
constexpr double kMinWeight = 0x1p-500;

void check_points(std::span<const Point3> points, const char* what) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(points[i][axis])) {
        throw std::invalid_argument(std::string(what) + " " + std::to_string(i) +
                                    " has a coordinate that is infinite or NaN; "
                                    "leave it out or give it a position");
      }
    }
  }
}

void check(std::span<const Point3> points, std::span<const double> weights, std::size_t clusters,
           const KMeansOptions& options) {
  assert(weights.empty() || weights.size() == points.size());
  assert(points.size() < UINT32_MAX);
  if (clusters == 0 || clusters > points.size()) {
    throw std::invalid_argument("cannot make " + std::to_string(clusters) + " clusters of " +
                                std::to_string(points.size()) +
                                " points: give from 1 to the number of points");
  }
  if (!(options.tolerance >= 0)) {
    throw std::invalid_argument(
        "the tolerance of k-means is negative or NaN; "
        "0 iterates until no assignment changes");
  }
  check_points(points, "point");
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0) || !std::isfinite(weights[i])) {
      throw std::invalid_argument("the weight of point " + std::to_string(i) +
                                  " is not a positive finite number; leave out points that "
                                  "should not count");
    }
  }
}

/// Weights divided by a power of two, so that the greatest is in [1/2, 1).
struct ScaledWeights {
  std::vector<double> values;
  int exponent = 0;

  explicit ScaledWeights(std::span<const double> weights) {
    if (weights.empty()) return;
    std::frexp(*std::max_element(weights.begin(), weights.end()), &exponent);
    values.reserve(weights.size());
    for (const double w : weights) {
      values.push_back(std::max(std::ldexp(w, -exponent), kMinWeight));
    }
  }
};

constexpr std::size_t kFan = KMeansTree::kFan;

/// Returns a lower bound of the squared distance from a point to a box, rounding errors included.
double squared_distance_bound(const Point3& p, const Box3& box) {
  return box.squared_distance(p) * (1 - 1e-14);
}

/// Draws seeds. Keeps the cost of every point for the seeds so far, and the sums of these costs
/// over the nodes of the tree.
class CentreSeeder {
 public:
  CentreSeeder(const KMeansTree& tree, const base::StopCheck& check_stop)
      : tree_(tree),
        ticks_(check_stop),
        cost_(tree.x.size(), std::numeric_limits<double>::infinity()) {
    for (const auto& level : tree.levels) {
      std::vector<State>& states = states_.emplace_back(level.size());
      // The first seed is drawn by weight alone.
      for (std::size_t k = 0; k < level.size(); ++k) {
        states[k] = {std::numeric_limits<double>::infinity(), level[k].weight};
      }
    }
  }

  /// Returns the sum of the costs of all points.
  [[nodiscard]] double total() const { return states_.back().front().sum; }

  /// Draws a position with probability proportional to its cost, or to its weight for the first
  /// seed. Requires: total() > 0.
  [[nodiscard]] std::size_t draw(bool first, std::mt19937_64& random) const {
    double target = base::draw_unit(random) * total();
    std::size_t node = 0;
    for (std::size_t level = states_.size() - 1; level-- > 0;) {
      node = find_part(node * kFan, std::min((node + 1) * kFan, states_[level].size()), target,
                       [&](std::size_t k) { return states_[level][k].sum; });
    }
    return find_part(
        node * KMeansTree::kBlock, std::min((node + 1) * KMeansTree::kBlock, tree_.count), target,
        [&](std::size_t position) { return first ? tree_.w[position] : cost(position); });
  }

  /// Returns by how much a seed at this point would lower total().
  [[nodiscard]] double gain(const Point3& seed) { return gain(seed, states_.size() - 1, 0); }

  /// Adds a seed.
  void add(const Point3& seed) { add(seed, states_.size() - 1, 0); }

 private:
  struct State {
    double largest;  // the largest squared distance of a point to its nearest seed
    double sum;      // sum of weight times squared distance
  };

  [[nodiscard]] double cost(std::size_t position) const {
    return tree_.w[position] * cost_[position];
  }

  /// Lays the sizes of the parts [first, end) end to end. Returns the part that contains `target`
  /// and subtracts the sizes before it. Never returns an empty part.
  template <class Size>
  static std::size_t find_part(std::size_t first, std::size_t end, double& target,
                               const Size& size) {
    std::size_t last = first;
    for (std::size_t k = first; k < end; ++k) {
      const double s = size(k);
      if (s <= 0) continue;
      last = k;
      if (target < s) break;
      target -= s;
    }
    return last;
  }

  [[nodiscard]] double gain(const Point3& seed, std::size_t level, std::size_t node) {
    ticks_(KMeansTree::kBlock);
    if (squared_distance_bound(seed, tree_.levels[level][node].box) >= states_[level][node].largest)
      return 0.0;
    double sum = 0;
    if (level == 0) {
      for (std::size_t position = node * KMeansTree::kBlock;
           position < (node + 1) * KMeansTree::kBlock; ++position) {
        const double d = squared(tree_.point(position), seed);
        sum += tree_.w[position] * std::max(cost_[position] - d, 0.0);
      }
    } else {
      const std::size_t end = std::min((node + 1) * kFan, states_[level - 1].size());
      for (std::size_t k = node * kFan; k < end; ++k) sum += gain(seed, level - 1, k);
    }
    return sum;
  }

  void add(const Point3& seed, std::size_t level, std::size_t node) {
    ticks_(KMeansTree::kBlock);
    State& state = states_[level][node];
    if (squared_distance_bound(seed, tree_.levels[level][node].box) >= state.largest) return;
    state = {0, 0};
    if (level == 0) {
      for (std::size_t position = node * KMeansTree::kBlock;
           position < (node + 1) * KMeansTree::kBlock; ++position) {
        cost_[position] = std::min(cost_[position], squared(tree_.point(position), seed));
        state.largest = std::max(state.largest, cost_[position]);
        state.sum += cost(position);
      }
    } else {
      const std::size_t end = std::min((node + 1) * kFan, states_[level - 1].size());
      for (std::size_t k = node * kFan; k < end; ++k) {
        add(seed, level - 1, k);
        state.largest = std::max(state.largest, states_[level - 1][k].largest);
        state.sum += states_[level - 1][k].sum;
      }
    }
  }

  const KMeansTree& tree_;
  base::StopTicks ticks_;
  std::vector<double> cost_;  // by position: squared distance to the nearest seed
  std::vector<std::vector<State>> states_;
};

/// Returns k seeds by greedy k-means++. For each seed it draws several candidates, with probability
/// proportional to weight times squared distance to the nearest seed so far, and takes the one that
/// leaves the least sum of these costs. It skips boxes that a new seed cannot improve.
std::vector<Point3> k_means_seeds(const KMeansTree& tree, std::size_t clusters,
                                  std::mt19937_64& random, const base::StopCheck& check_stop) {
  CentreSeeder seeder(tree, check_stop);
  std::vector<Point3> seeds{tree.point(seeder.draw(true, random))};
  seeder.add(seeds.front());
  // 0.7 is approximately the natural logarithm of 2.
  const std::size_t draws = 2 + static_cast<std::size_t>(std::bit_width(clusters)) * 7 / 10;
  while (seeds.size() < clusters) {
    // If every point coincides with a seed, further clusters stay empty.
    if (seeder.total() <= 0) {
      seeds.resize(clusters, seeds.front());
      break;
    }
    Point3 best{};
    double largest = -1;
    for (std::size_t k = 0; k < draws; ++k) {
      const Point3 seed = tree.point(seeder.draw(false, random));
      const double gain = seeder.gain(seed);
      if (gain > largest) {
        largest = gain;
        best = seed;
      }
    }
    seeder.add(best);
    seeds.push_back(best);
  }
  return seeds;
}

/// One run of Lloyd's iteration, in scaled units.
struct Run {
  Run(const KMeansTree& the_tree, base::ThreadTeam& team, std::vector<Point3> start,
      const base::StopCheck& check_stop)
      : tree(the_tree),
        filter(the_tree, start.size(), team, check_stop),
        centres(std::move(start)) {}

  void iterate(const KMeansOptions& options, double diagonal) {
    const double tolerance2 = options.tolerance * diagonal * options.tolerance * diagonal;
    bool assigned = false;  // whether the points are assigned to the current centres
    while (iterations < options.max_iterations && !converged) {
      const bool changed = filter.assign(centres);
      ++iterations;
      const bool filled = fill_empty();
      if (!changed && !filled) {
        converged = assigned = true;
        break;
      }
      double largest = 0;
      for (std::size_t c = 0; c < centres.size(); ++c) {
        const KMeansFilter::Sum& sum = filter.sums()[c];
        if (sum.weight == 0) continue;
        const Point3 mean{sum.sum[0] / sum.weight, sum.sum[1] / sum.weight,
                          sum.sum[2] / sum.weight};
        largest = std::max(largest, squared(mean, centres[c]));
        centres[c] = mean;
      }
      converged = options.tolerance > 0 && largest <= tolerance2;
    }
    if (!assigned) filter.assign(centres);
    sse = 0;
    for (std::size_t position = 0; position < tree.count; ++position) sse += cost(position);
  }

  /// Moves a point to each empty cluster, as k_means.hpp describes. Returns whether any point
  /// moved.
  bool fill_empty() {
    const std::span<KMeansFilter::Sum> sums = filter.sums();
    const auto is_empty = [](const KMeansFilter::Sum& sum) { return sum.weight == 0; };
    if (std::none_of(sums.begin(), sums.end(), is_empty)) return false;
    std::vector<std::size_t> size(centres.size(), 0);
    std::vector<std::size_t> order;
    for (std::size_t position = 0; position < tree.count; ++position) {
      ++size[filter.cluster(position)];
      if (squared(tree.point(position), centres[filter.cluster(position)]) > kAtCentre2) {
        order.push_back(position);
      }
    }
    const auto costs_less = [&](std::size_t a, std::size_t b) {
      const double cost_a = cost(a);
      const double cost_b = cost(b);
      return cost_a < cost_b || (cost_a == cost_b && tree.original[a] > tree.original[b]);
    };
    std::make_heap(order.begin(), order.end(), costs_less);
    std::vector<std::pair<std::size_t, std::uint32_t>> reassigned;
    for (std::uint32_t c = 0; c < centres.size(); ++c) {
      if (!is_empty(sums[c])) continue;
      while (!order.empty()) {
        std::pop_heap(order.begin(), order.end(), costs_less);
        const std::size_t position = order.back();
        order.pop_back();
        if (size[filter.cluster(position)] < 2) continue;
        --size[filter.cluster(position)];
        reassigned.emplace_back(position, c);
        break;
      }
    }
    if (reassigned.empty()) return false;
    for (const auto& [position, c] : reassigned) filter.move_point(position, c);
    // Recomputes the sums, because subtracting a heavy point would leave rounding errors of its
    // size.
    std::fill(sums.begin(), sums.end(), KMeansFilter::Sum{});
    for (std::size_t position = 0; position < tree.count; ++position) {
      KMeansFilter::Sum& sum = sums[filter.cluster(position)];
      const Point3 p = tree.point(position);
      for (unsigned axis = 0; axis < 3; ++axis) sum.sum[axis] += tree.w[position] * p[axis];
      sum.weight += tree.w[position];
    }
    return true;
  }

  [[nodiscard]] double cost(std::size_t position) const {
    return tree.w[position] * squared(tree.point(position), centres[filter.cluster(position)]);
  }

  const KMeansTree& tree;
  KMeansFilter filter;
  std::vector<Point3> centres;
  std::size_t iterations = 0;
  bool converged = false;
  double sse = 0;
};

Point3 unscaled(const Point3& p, const Scaling& scaling) {
  Point3 result{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double corner = scaling.corner[axis];
    // Uses halves if the sides overflow a double.
    result[axis] = scaling.plain || scaling.exponent < 0
                       ? corner + scaling.unscaled(p[axis])
                       : 2 * (0.5 * corner + std::ldexp(p[axis], scaling.exponent - 1));
  }
  return result;
}

KMeansResult result_of(const Run& run, const Scaling& scaling, int weight_exponent) {
  KMeansResult result;
  result.centres.reserve(run.centres.size());
  for (const Point3& c : run.centres) result.centres.push_back(unscaled(c, scaling));
  result.assignment.resize(run.tree.count);
  for (std::size_t position = 0; position < run.tree.count; ++position) {
    result.assignment[run.tree.original[position]] = run.filter.cluster(position);
  }
  result.sse = std::ldexp(run.sse, 2 * scaling.exponent + weight_exponent);
  result.iterations = run.iterations;
  result.converged = run.converged;
  return result;
}

}  // namespace

KMeansResult k_means(std::span<const Point3> points, std::span<const double> weights,
                     const KMeansOptions& options) {
  check(points, weights, options.clusters, options);
  if (options.restarts == 0) {
    throw std::invalid_argument("restarts is 0: give at least 1, which is a single run");
  }
  const Scaling scaling(points);
  const ScaledWeights scaled_weights(weights);
  const KMeansTree tree(points, scaled_weights.values, scaling, options.check_stop);
  base::ThreadTeam team(std::max(options.threads, 1u));
  std::mt19937_64 random(options.seed);
  KMeansResult best;
  double least = 0;
  for (std::size_t restart = 0; restart < options.restarts; ++restart) {
    Run run(tree, team, k_means_seeds(tree, options.clusters, random, options.check_stop),
            options.check_stop);
    run.iterate(options, scaling.diagonal);
    if (restart > 0 && run.sse >= least) continue;
    least = run.sse;
    best = result_of(run, scaling, scaled_weights.exponent);
  }
  return best;
}

KMeansResult k_means_from(std::span<const Point3> centres, std::span<const Point3> points,
                          std::span<const double> weights, const KMeansOptions& options) {
  check(points, weights, centres.size(), options);
  check_points(centres, "centre");
  const Scaling scaling(points);
  const ScaledWeights scaled_weights(weights);
  const KMeansTree tree(points, scaled_weights.values, scaling, options.check_stop);
  base::ThreadTeam team(std::max(options.threads, 1u));
  std::vector<Point3> start;
  start.reserve(centres.size());
  for (const Point3& c : centres) {
    Point3 p = scaling.scaled(c);
    for (double& v : p) v = std::clamp(v, -kFarthest, kFarthest);
    start.push_back(p);
  }
  Run run(tree, team, std::move(start), options.check_stop);
  run.iterate(options, scaling.diagonal);
  return result_of(run, scaling, scaled_weights.exponent);
}

std::vector<std::uint32_t> nearest_to_means(std::span<const Point3> points,
                                            std::span<const std::uint32_t> labels,
                                            std::size_t clusters) {
  assert(labels.size() == points.size());
  std::vector<Point3> mean(clusters, Point3{});
  std::vector<double> count(clusters, 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) mean[labels[i]][axis] += points[i][axis];
    count[labels[i]] += 1.0;
  }
  for (std::size_t c = 0; c < clusters; ++c) {
    for (double& v : mean[c]) v /= std::max(count[c], 1.0);
  }
  std::vector<std::uint32_t> nearest(clusters, 0);
  std::vector<double> least(clusters, std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::uint32_t c = labels[i];
    const double d = distance(Euclidean{}, mean[c], points[i]);
    // If the sums overflow, no distance is finite, and the first point represents the cluster.
    if (d < least[c] || labels[nearest[c]] != c) {
      least[c] = d;
      nearest[c] = i;
    }
  }
  return nearest;
}

}  // namespace terrace::cluster
