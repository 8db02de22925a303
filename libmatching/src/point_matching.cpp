// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_matching.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "blossom/kd_tree.hpp"
#include "blossom/pricing.hpp"
#include "blossom/solver.hpp"

namespace terrace::matching {
namespace {

using blossom::Edge;
using blossom::KdTree;
using blossom::PairCost;
using blossom::Pricing;
using blossom::Solver;

[[noreturn]] void refuse_points(const std::string& what) {
  throw std::invalid_argument("match_points: " + what);
}

template <std::size_t D>
class Problem {
 public:
  using Point = std::array<double, D>;

  Problem(std::span<const Point> points, const PointMatchingOptions& options)
      : input_(points), options_(options) {
    check();
    order_ = blossom::halving_order(points, base::StopTicks(options.check_stop));
    place_.resize(points.size());
    for (std::uint32_t k = 0; k < order_.size(); ++k) place_[order_[k]] = k;
    scale_points();
    set_cost();
    set_candidates();
  }

  PointMatching solve() {
    for (int bits = 48;; bits -= 9) {
      try {
        return solve(bits);
      } catch (const std::overflow_error&) {
        if (bits <= 21) throw;
      }
    }
  }

 private:
  void check() const {
    if (input_.size() > std::size_t{1} << 29) {
      refuse_points(std::to_string(input_.size()) + " points would need about " +
                    std::to_string(input_.size() >> 20) + " GiB; at most 2^29 are possible");
    }
    for (std::size_t k = 0; k < input_.size(); ++k) {
      for (const double c : input_[k]) {
        if (!std::isfinite(c)) {
          refuse_points("a coordinate of point " + std::to_string(k) +
                        " is not finite; leave it out");
        }
      }
    }
    if (options_.neighbours == 0) refuse_points("neighbours is 0; at least one is needed");
    if (!(options_.metric.factor >= 0.0) || !(options_.metric.offset >= 0.0) ||
        !std::isfinite(options_.metric.factor) || !std::isfinite(options_.metric.offset)) {
      refuse_points("factor and offset of a metric must be finite and not negative");
    }
    for (std::size_t k = 0; k < options_.candidates.size(); ++k) {
      const auto& [i, j] = options_.candidates[k];
      if (i >= input_.size() || j >= input_.size() || i == j) {
        refuse_points("candidate " + std::to_string(k) + " joins " + std::to_string(i) + " and " +
                      std::to_string(j) + "; ends must differ and be below " +
                      std::to_string(input_.size()));
      }
    }
  }

  // Scales by a power of two, which is exact, so that squares neither overflow nor underflow.
  void scale_points() {
    double largest = 0.0;
    for (const Point& p : input_) {
      for (const double c : p) largest = std::max(largest, std::abs(c));
    }
    if (largest > 0x1p400 || (largest < 0x1p-400 && largest > 0.0)) std::frexp(largest, &shift_);
    points_.resize(input_.size());
    for (std::size_t k = 0; k < points_.size(); ++k) {
      points_[k] = input_[order_[k]];
      for (double& c : points_[k]) c = std::ldexp(c, -shift_);
    }
  }

  void set_cost() {
    if (!options_.metric.distance) {
      cost_.distance = [this](std::uint32_t i, std::uint32_t j) {
        return std::sqrt(KdTree<D>::distance2(points_[i], points_[j]));
      };
      return;
    }
    cost_.factor = std::ldexp(options_.metric.factor, shift_);
    cost_.offset = options_.metric.offset;
    cost_.distance = [this](std::uint32_t i, std::uint32_t j) {
      const double d = options_.metric.distance(order_[i], order_[j]);
      if (!std::isfinite(d)) {
        refuse_points("the metric's distance of points " + std::to_string(order_[i]) + " and " +
                      std::to_string(order_[j]) + " is not finite");
      }
      return d;
    };
  }

  // Collects nearest neighbours, the caller's edges, and pairs along the halving order. The latter
  // form a perfect matching, which makes the graph feasible.
  void set_candidates() {
    const auto n = static_cast<std::uint32_t>(points_.size());
    const KdTree<D> tree(points_);
    std::vector<std::pair<double, std::uint32_t>> neighbours;
    const auto add_candidate = [&](std::uint32_t i, std::uint32_t j) {
      candidates_.emplace_back(std::min(i, j), std::max(i, j));
    };
    base::StopTicks ticks(options_.check_stop);
    constexpr std::size_t kTicksOfSearch = 1024;
    for (std::uint32_t i = 0; i < n; ++i) {
      ticks(kTicksOfSearch);
      tree.nearest(i, options_.neighbours, neighbours);
      for (const auto& [d, j] : neighbours) add_candidate(i, j);
      if (i % 2 == 1) add_candidate(i - 1, i);
    }
    for (const auto& [i, j] : options_.candidates) add_candidate(place_[i], place_[j]);
    std::sort(candidates_.begin(), candidates_.end());
    candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
    for (const auto& [i, j] : candidates_) {
      longest_candidate_ = std::max(longest_candidate_, std::abs(cost_.distance(i, j)));
    }
  }

  PointMatching solve(int bits) {
    const auto n = static_cast<std::uint32_t>(points_.size());
    int exponent = 0;
    std::frexp(longest_candidate_, &exponent);
    cost_.scale = std::ldexp(1.0, std::min(bits - exponent, 1000));
    std::vector<Edge> edges;
    edges.reserve(candidates_.size() + (n % 2 == 0 ? 0 : n));
    for (const auto& [i, j] : candidates_) edges.push_back({i, j, cost_(i, j)});
    // An odd number of points gets a dummy vertex with edges of cost 0 to all points.
    const std::uint32_t dummy = n % 2 == 0 ? kNone : n;
    for (std::uint32_t i = 0; dummy != kNone && i < n; ++i) edges.push_back({i, n, 0});
    const base::StopTicks ticks(options_.check_stop);
    Solver solver(n + n % 2, std::move(edges), dummy, ticks);
    Pricing<D> pricing(points_, cost_, ticks);
    PointMatching result;
    while (true) {
      if (solver.solve() != kNone) throw std::logic_error("match_points: no matching");
      ++result.rounds;
      const std::vector<Edge> violated = pricing.violated(solver);
      if (violated.empty()) break;
      solver.add(violated);
    }
    result.edges = solver.edge_count();
    fill(solver, result);
    return result;
  }

  void fill(Solver& solver, PointMatching& result) const {
    const auto n = static_cast<std::uint32_t>(points_.size());
    const Matching sorted = blossom::proof_of(solver);
    Matching& proof = result.proof;
    proof = sorted;
    const auto original = [&](std::uint32_t k) { return k < n ? order_[k] : k; };
    for (std::uint32_t k = 0; k < sorted.mate.size(); ++k) {
      proof.mate[original(k)] = original(sorted.mate[k]);
      proof.vertex_dual[original(k)] = sorted.vertex_dual[k];
      proof.vertex_blossom[original(k)] = sorted.vertex_blossom[k];
    }
    result.mate.assign(n, kNone);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = proof.mate[i];
      if (j >= n) {
        result.left_over = i;
        continue;
      }
      result.mate[i] = j;
      if (i < j) result.cost += cost_.distance(place_[i], place_[j]);
    }
    // Converts the unit of the scaled points back to the caller's.
    const int shift = options_.metric.distance ? 0 : shift_;
    result.cost = std::ldexp(result.cost, shift);
    proof.exponent = std::ilogb(cost_.scale) - shift;
    result.dual_bound = proof.dual_bound();
    proof.cost = result.cost;
    if (!std::isfinite(result.cost)) refuse_points("the cost overflows a double; scale the points");
  }

  std::span<const Point> input_;
  const PointMatchingOptions& options_;
  std::vector<std::uint32_t> order_, place_;  // by halving order; its inverse
  std::vector<Point> points_;                 // in halving order, times 2^-shift_
  int shift_ = 0;
  PairCost cost_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> candidates_;
  double longest_candidate_ = 0.0;
};

template <std::size_t D>
PointMatching match(std::span<const std::array<double, D>> points,
                    const PointMatchingOptions& options) {
  return Problem<D>(points, options).solve();
}

}  // namespace

PointMatching match_points(std::span<const Point2> points, const PointMatchingOptions& options) {
  return match<2>(points, options);
}

PointMatching match_points(std::span<const Point3> points, const PointMatchingOptions& options) {
  return match<3>(points, options);
}

}  // namespace terrace::matching
