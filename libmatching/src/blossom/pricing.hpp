// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "blossom/kd_tree.hpp"
#include "blossom/nesting_tree.hpp"
#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

/// The doubled integer cost of a pair of points, and a lower bound from its Euclidean distance.
struct PairCost {
  static constexpr std::int64_t kMaxCost = kLimit / 4;
  std::function<double(std::uint32_t, std::uint32_t)> distance;
  double factor = 1.0, offset = 0.0;
  double scale = 1.0;

  /// Returns the cost, capped at kMaxCost.
  std::int64_t operator()(std::uint32_t i, std::uint32_t j) const {
    const double scaled = distance(i, j) * scale;
    if (scaled >= static_cast<double>(kMaxCost / 2)) return kMaxCost;
    return 2 * std::llround(scaled);
  }

  /// Returns whether points at this squared distance may cost less than the sum of their duals. May
  /// return true wrongly, but never false: a margin of 1e-13 covers rounding.
  bool may_violate(double squared_distance, std::int64_t duals) const {
    const double least =
        2.0 * scale * (factor * std::sqrt(squared_distance) * (1.0 - 1e-13) - offset);
    const auto sum = static_cast<double>(duals);
    return least * (least > 0.0 ? 1.0 - 1e-13 : 1.0 + 1e-13) - 2.0 <= sum + std::abs(sum) * 1e-13;
  }
};

/// Finds pairs of points that are closer than the duals of a solution allow, on the complete graph.
///
/// For a pair, the blossoms with exactly one end inside are those below the innermost one around
/// both. The nest of blossoms (with the whole set as the outermost) is divided into chains, each of
/// which continues into the largest part. One tree of boxes serves a whole chain. A point in a
/// small part of a chain's blossom is tested against the points of the other parts, with potentials
/// counted from that blossom inward. Each small part is then the head of its own chain. So a point
/// is tested O(log n) times, however deep the nest.
template <std::size_t D>
class Pricing {
 public:
  using Point = std::array<double, D>;

  /// points: in halving order. Point i is the solver's vertex i.
  Pricing(std::span<const Point> points, const PairCost& cost, base::StopTicks ticks = {})
      : points_(points), cost_(cost), ticks_(ticks) {}

  /// Returns some of the violated pairs: the worst few of each part, and more for large parts.
  std::vector<Edge> violated(const Solver& solver) {
    nesting_ = NestingTree(solver);
    found_.clear();
    heads_.assign(1, {kNone, 0});
    while (!heads_.empty()) {
      ticks_();
      const Head head = heads_.back();
      heads_.pop_back();
      follow(head, solver);
      price();
    }
    return std::move(found_);
  }

 private:
  static constexpr std::size_t kMaxPerPoint = 8;

  /// A blossom, and the sum of the duals of the blossoms around it without its own dual.
  struct Head {
    std::uint32_t node;
    std::int64_t outer_sum;
  };
  struct Violation {
    std::uint32_t part, from, to;
    std::int64_t excess;  // of the cost over the duals, negative
  };
  struct Member {
    std::uint32_t vertex, part, level;
    std::int64_t potential;
  };

  // Follows the chain from a head. Collects its levels, and its vertices with the level at which
  // each leaves the chain.
  void follow(const Head& head, const Solver& solver) {
    members_.clear();
    outer_duals_.clear();
    std::uint32_t node = head.node;
    std::int64_t outer_sum = head.outer_sum;
    while (true) {
      if (node != kNone) outer_sum += solver.blossom_dual(node);
      outer_duals_.push_back(outer_sum);
      std::uint32_t largest = kNone;
      for (const std::uint32_t child : nesting_.children_of(node)) {
        if (child >= solver.vertex_count() &&
            (largest == kNone || nesting_.size(child) > nesting_.size(largest))) {
          largest = child;
        }
      }
      for (const std::uint32_t child : nesting_.children_of(node)) {
        if (child == largest) continue;
        add_part(child, solver);
        if (child >= solver.vertex_count()) heads_.push_back({child, outer_sum});
      }
      if (largest == kNone) break;
      node = largest;
    }
    std::sort(members_.begin(), members_.end(),
              [](const Member& a, const Member& b) { return a.vertex < b.vertex; });
  }

  void add_part(std::uint32_t node, const Solver& solver) {
    const auto level = static_cast<std::uint32_t>(outer_duals_.size() - 1);
    for (const std::uint32_t v : nesting_.vertices_of(node)) {
      // The dummy vertex already has edges to all points.
      if (v < points_.size()) members_.push_back({v, node, level, solver.potential(v)});
    }
  }

  void test(const Member& a, const Member& b,
            std::vector<std::pair<std::int64_t, std::uint32_t>>& worst) {
    const std::int64_t duals = a.potential + b.potential - 2 * outer_duals_[a.level];
    if (!cost_.may_violate(KdTree<D>::distance2(points_[a.vertex], points_[b.vertex]), duals)) {
      return;
    }
    const std::int64_t cost = cost_(a.vertex, b.vertex);
    if (cost >= duals) return;
    if (cost >= PairCost::kMaxCost) {
      throw std::overflow_error("match_points: the duals overflow 64 bits");
    }
    const std::pair<std::int64_t, std::uint32_t> entry{cost - duals, b.vertex};
    worst.insert(std::upper_bound(worst.begin(), worst.end(), entry), entry);
    if (worst.size() > kMaxPerPoint) worst.pop_back();
  }

  // Tests each pair of different parts once, from the end that leaves the chain first.
  bool is_tested_from(std::uint32_t i, std::uint32_t j) const {
    const Member &a = members_[i], &b = members_[j];
    return a.part != b.part && (b.level > a.level || (b.level == a.level && i < j));
  }

  // If two large parts are too close, so are all their pairs. A few of them suffice.
  void select_violations() {
    std::sort(violations_.begin(), violations_.end(), [](const Violation& a, const Violation& b) {
      return std::tie(a.part, a.excess, a.from, a.to) < std::tie(b.part, b.excess, b.from, b.to);
    });
    std::uint32_t part = kNone;
    std::size_t taken = 0;
    for (const Violation& w : violations_) {
      taken = w.part == part ? taken + 1 : 0;
      part = w.part;
      if (taken >= kMaxPerPoint + nesting_.size(part) / 8) continue;
      const std::uint32_t i = members_[w.from].vertex;
      found_.push_back({i, w.to, cost_(i, w.to)});
    }
  }

  void price() {
    std::vector<std::pair<std::int64_t, std::uint32_t>> worst;
    violations_.clear();
    const auto record = [&](std::uint32_t k) {
      for (const auto& [excess, j] : worst) violations_.push_back({members_[k].part, k, j, excess});
      worst.clear();
    };
    const auto count = static_cast<std::uint32_t>(members_.size());
    if (count <= 4 * kLeaf) {
      for (std::uint32_t i = 0; i < count; ++i) {
        ticks_(count);
        for (std::uint32_t j = 0; j < count; ++j) {
          if (is_tested_from(i, j)) test(members_[i], members_[j], worst);
        }
        record(i);
      }
      select_violations();
      return;
    }
    std::vector<Point> points(count);
    for (std::uint32_t k = 0; k < count; ++k) points[k] = points_[members_[k].vertex];
    const KdTree<D> tree(std::move(points));
    const auto& nodes = tree.nodes();
    // For each box: the largest potential, and the part if all its points belong to the same one.
    std::vector<std::int64_t> max_potential(nodes.size());
    std::vector<std::uint32_t> part(nodes.size()), max_level(nodes.size());
    for (std::size_t x = nodes.size(); x-- > 0;) {
      const auto& node = nodes[x];
      if (node.right != 0) {
        max_potential[x] = std::max(max_potential[x + 1], max_potential[node.right]);
        max_level[x] = std::max(max_level[x + 1], max_level[node.right]);
        part[x] = part[x + 1] == part[node.right] ? part[x + 1] : kNone;
        continue;
      }
      max_potential[x] = members_[node.begin].potential;
      part[x] = members_[node.begin].part;
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        max_potential[x] = std::max(max_potential[x], members_[k].potential);
        max_level[x] = std::max(max_level[x], members_[k].level);
        if (members_[k].part != part[x]) part[x] = kNone;
      }
    }
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Member& a = members_[i];
      open.assign(1, 0);
      while (!open.empty()) {
        ticks_(kLeaf);
        const std::uint32_t x = open.back();
        open.pop_back();
        const auto& node = nodes[x];
        if (max_level[x] < a.level || (max_level[x] == a.level && node.end <= i + 1) ||
            part[x] == a.part ||
            !cost_.may_violate(node.box.squared_distance(points_[a.vertex]),
                               a.potential + max_potential[x] - 2 * outer_duals_[a.level])) {
          continue;
        }
        if (node.right != 0) {
          open.push_back(node.right);
          open.push_back(x + 1);
          continue;
        }
        for (std::uint32_t j = node.begin; j < node.end; ++j) {
          if (is_tested_from(i, j)) test(a, members_[j], worst);
        }
      }
      record(i);
    }
    select_violations();
  }

  std::span<const Point> points_;
  const PairCost& cost_;
  base::StopTicks ticks_;
  NestingTree nesting_;
  std::vector<Head> heads_;
  std::vector<Member> members_;
  // for each level of the chain: the sum of the duals around it, including its own dual
  std::vector<std::int64_t> outer_duals_;
  std::vector<Violation> violations_;
  std::vector<Edge> found_;
};

}  // namespace terrace::matching::blossom
