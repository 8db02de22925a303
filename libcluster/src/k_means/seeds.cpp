// SPDX-License-Identifier: Apache-2.0
#include "k_means/seeds.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

constexpr std::size_t kFan = KMeansTree::kFan;

/// Returns the squared distance from a point to a box, minus a bound of its rounding error.
double below_box(const Point3& p, const KMeansTree::Node& box) {
  double sum = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double d = std::max({box.low[axis] - p[axis], p[axis] - box.high[axis], 0.0});
    sum += d * d;
  }
  return sum * (1 - 1e-14);
}

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

  /// Returns the sum of costs that remains with the seeds so far.
  [[nodiscard]] double total() const { return states_.back().front().sum; }

  /// Returns a position drawn with probability proportional to its cost. Requires: total() > 0.
  [[nodiscard]] std::size_t draw(bool first, std::mt19937_64& random) const {
    double at = base::draw_unit(random) * total();
    std::size_t node = 0;
    for (std::size_t level = states_.size() - 1; level-- > 0;) {
      node = chosen(node * kFan, std::min((node + 1) * kFan, states_[level].size()), at,
                    [&](std::size_t k) { return states_[level][k].sum; });
    }
    return chosen(node * KMeansTree::kBlock, std::min((node + 1) * KMeansTree::kBlock, tree_.count),
                  at, [&](std::size_t place) { return first ? tree_.w[place] : cost(place); });
  }

  /// Returns by how much a seed there would lower total().
  [[nodiscard]] double gain(const Point3& seed) { return gain(seed, states_.size() - 1, 0); }

  void add(const Point3& seed) { add(seed, states_.size() - 1, 0); }

 private:
  struct State {
    double most;  // the largest squared distance of a point below
    double sum;   // sum of weight times squared distance
  };

  [[nodiscard]] double cost(std::size_t place) const { return tree_.w[place] * cost_[place]; }

  /// Returns the part of [first, end) in which `at` falls, never an empty part.
  template <class Size>
  static std::size_t chosen(std::size_t first, std::size_t end, double& at, const Size& size) {
    std::size_t last = first;
    for (std::size_t k = first; k < end; ++k) {
      const double s = size(k);
      if (s <= 0) continue;
      last = k;
      if (at < s) break;
      at -= s;
    }
    return last;
  }

  [[nodiscard]] double gain(const Point3& seed, std::size_t level, std::size_t node) {
    ticks_(KMeansTree::kBlock);
    if (below_box(seed, tree_.levels[level][node]) >= states_[level][node].most) return 0.0;
    double sum = 0;
    if (level == 0) {
      for (std::size_t place = node * KMeansTree::kBlock; place < (node + 1) * KMeansTree::kBlock;
           ++place) {
        const double d = squared(tree_.point(place), seed);
        sum += tree_.w[place] * std::max(cost_[place] - d, 0.0);
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
    if (below_box(seed, tree_.levels[level][node]) >= state.most) return;
    state = {0, 0};
    if (level == 0) {
      for (std::size_t place = node * KMeansTree::kBlock; place < (node + 1) * KMeansTree::kBlock;
           ++place) {
        cost_[place] = std::min(cost_[place], squared(tree_.point(place), seed));
        state.most = std::max(state.most, cost_[place]);
        state.sum += cost(place);
      }
    } else {
      const std::size_t end = std::min((node + 1) * kFan, states_[level - 1].size());
      for (std::size_t k = node * kFan; k < end; ++k) {
        add(seed, level - 1, k);
        state.most = std::max(state.most, states_[level - 1][k].most);
        state.sum += states_[level - 1][k].sum;
      }
    }
  }

  const KMeansTree& tree_;
  base::StopTicks ticks_;
  std::vector<double> cost_;  // by position: squared distance to the nearest seed
  std::vector<std::vector<State>> states_;
};

}  // namespace

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
    double most = -1;
    for (std::size_t k = 0; k < draws; ++k) {
      const Point3 seed = tree.point(seeder.draw(false, random));
      const double gain = seeder.gain(seed);
      if (gain > most) {
        most = gain;
        best = seed;
      }
    }
    seeder.add(best);
    seeds.push_back(best);
  }
  return seeds;
}

}  // namespace terrace::cluster
