// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_means.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/thread_team.hpp>

#include "k_means/filter.hpp"
#include "k_means/seeds.hpp"
#include "k_means/tree.hpp"
#include "scaling.hpp"
#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {
namespace {

// Points nearer to their centre than this (in the unit of the box, squared) count as being at it,
// because a mean of many points is rounded.
constexpr double kAtCentre2 = 0x1p-72;
// Limit for the caller's centres in the same unit. Beyond it squares would overflow.
constexpr double kFarthest = 0x1p+400;
constexpr double kLeastWeight = 0x1p-500;

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
      values.push_back(std::max(std::ldexp(w, -exponent), kLeastWeight));
    }
  }
};

/// One run of Lloyd's iteration. Everything is in scaled units.
struct Run {
  Run(const KMeansTree& the_tree, base::ThreadTeam& team, std::vector<Point3> start,
      const base::StopCheck& check_stop)
      : tree(the_tree),
        filter(the_tree, start.size(), team, check_stop),
        centres(std::move(start)) {}

  void iterate(const KMeansOptions& options, double diagonal) {
    const double still2 = options.tolerance * diagonal * options.tolerance * diagonal;
    bool assigned = false;  // whether the points are assigned to the current centres
    while (iterations < options.max_iterations && !converged) {
      const bool changed = filter.assign(centres);
      ++iterations;
      const bool moved = fill_empty();
      if (!changed && !moved) {
        converged = assigned = true;
        break;
      }
      double most = 0;
      for (std::size_t c = 0; c < centres.size(); ++c) {
        const KMeansFilter::Sum& sum = filter.sums()[c];
        if (sum.weight == 0) continue;
        const Point3 mean{sum.sum[0] / sum.weight, sum.sum[1] / sum.weight,
                          sum.sum[2] / sum.weight};
        most = std::max(most, squared(mean, centres[c]));
        centres[c] = mean;
      }
      converged = options.tolerance > 0 && most <= still2;
    }
    if (!assigned) filter.assign(centres);
    sse = 0;
    for (std::size_t place = 0; place < tree.count; ++place) sse += cost(place);
  }

  /// Gives each empty cluster a point, as described in k_means.hpp. Returns whether there was a
  /// point to give.
  bool fill_empty() {
    const std::span<KMeansFilter::Sum> sums = filter.sums();
    const auto is_empty = [](const KMeansFilter::Sum& sum) { return sum.weight == 0; };
    if (std::none_of(sums.begin(), sums.end(), is_empty)) return false;
    std::vector<std::size_t> size(centres.size(), 0);
    std::vector<std::size_t> order;
    for (std::size_t place = 0; place < tree.count; ++place) {
      ++size[filter.cluster(place)];
      if (squared(tree.point(place), centres[filter.cluster(place)]) > kAtCentre2) {
        order.push_back(place);
      }
    }
    const auto costs_less = [&](std::size_t a, std::size_t b) {
      const double of_a = cost(a);
      const double of_b = cost(b);
      return of_a < of_b || (of_a == of_b && tree.original[a] > tree.original[b]);
    };
    std::make_heap(order.begin(), order.end(), costs_less);
    std::vector<std::pair<std::size_t, std::uint32_t>> moves;
    for (std::uint32_t c = 0; c < centres.size(); ++c) {
      if (!is_empty(sums[c])) continue;
      while (!order.empty()) {
        std::pop_heap(order.begin(), order.end(), costs_less);
        const std::size_t place = order.back();
        order.pop_back();
        if (size[filter.cluster(place)] < 2) continue;
        --size[filter.cluster(place)];
        moves.emplace_back(place, c);
        break;
      }
    }
    if (moves.empty()) return false;
    for (const auto& [place, c] : moves) filter.move_point(place, c);
    // Sums are recomputed, because subtracting a heavy point would leave rounding errors of its
    // size.
    std::fill(sums.begin(), sums.end(), KMeansFilter::Sum{});
    for (std::size_t place = 0; place < tree.count; ++place) {
      KMeansFilter::Sum& sum = sums[filter.cluster(place)];
      const Point3 p = tree.point(place);
      for (unsigned axis = 0; axis < 3; ++axis) sum.sum[axis] += tree.w[place] * p[axis];
      sum.weight += tree.w[place];
    }
    return true;
  }

  [[nodiscard]] double cost(std::size_t place) const {
    return tree.w[place] * squared(tree.point(place), centres[filter.cluster(place)]);
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
  for (std::size_t place = 0; place < run.tree.count; ++place) {
    result.assignment[run.tree.original[place]] = run.filter.cluster(place);
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
