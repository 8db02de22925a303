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
#include "blossom/nest.hpp"
#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

/// The doubled integer cost of a pair of points, and a lower bound from its Euclidean distance.
struct PairCost {
  static constexpr std::int64_t kFar = kLimit / 4;
  std::function<double(std::uint32_t, std::uint32_t)> distance;
  double factor = 1.0, offset = 0.0;
  double scale = 1.0;

  /// Returns the cost, capped at kFar.
  std::int64_t operator()(std::uint32_t i, std::uint32_t j) const {
    const double scaled = distance(i, j) * scale;
    if (scaled >= static_cast<double>(kFar / 2)) return kFar;
    return 2 * std::llround(scaled);
  }

  /// Returns whether points at this squared distance may cost less than the sum of their duals. May
  /// return true wrongly, but never false: a margin of 1e-13 covers rounding.
  bool may_violate(double apart2, std::int64_t duals) const {
    const double least = 2.0 * scale * (factor * std::sqrt(apart2) * (1.0 - 1e-13) - offset);
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

  /// points: in halving order; point i is the solver's vertex i.
  Pricing(std::span<const Point> points, const PairCost& cost, base::StopTicks ticks = {})
      : points_(points), cost_(cost), ticks_(ticks) {}

  /// Returns some of the violated pairs: the worst few of each part, and more for large parts.
  std::vector<Edge> violated(const Solver& solver) {
    nest_ = Nest(solver);
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
  static constexpr std::size_t kMost = 8;

  /// A blossom and the sum of the duals of the blossoms around it, without its own.
  struct Head {
    std::uint32_t node;
    std::int64_t around;
  };
  struct Wanted {
    std::uint32_t part, from, to;
    std::int64_t excess;  // negative
  };
  struct Member {
    std::uint32_t vertex, part, level;
    std::int64_t potential;
  };

  // Follows the chain from a head. Collects its levels, and its vertices with the level at which
  // each leaves the chain.
  void follow(const Head& head, const Solver& solver) {
    members_.clear();
    around_.clear();
    std::uint32_t node = head.node;
    std::int64_t around = head.around;
    while (true) {
      if (node != kNone) around += solver.blossom_dual(node);
      around_.push_back(around);
      std::uint32_t largest = kNone;
      for (const std::uint32_t child : nest_.children_of(node)) {
        if (child >= solver.vertex_count() &&
            (largest == kNone || nest_.size(child) > nest_.size(largest))) {
          largest = child;
        }
      }
      for (const std::uint32_t child : nest_.children_of(node)) {
        if (child == largest) continue;
        add_part(child, solver);
        if (child >= solver.vertex_count()) heads_.push_back({child, around});
      }
      if (largest == kNone) break;
      node = largest;
    }
    std::sort(members_.begin(), members_.end(),
              [](const Member& a, const Member& b) { return a.vertex < b.vertex; });
  }

  void add_part(std::uint32_t node, const Solver& solver) {
    const auto level = static_cast<std::uint32_t>(around_.size() - 1);
    for (const std::uint32_t v : nest_.vertices_of(node)) {
      // The vertex for nobody already has edges to all points.
      if (v < points_.size()) members_.push_back({v, node, level, solver.potential(v)});
    }
  }

  void test(const Member& a, const Member& b,
            std::vector<std::pair<std::int64_t, std::uint32_t>>& worst) {
    const std::int64_t duals = a.potential + b.potential - 2 * around_[a.level];
    if (!cost_.may_violate(KdTree<D>::distance2(points_[a.vertex], points_[b.vertex]), duals)) {
      return;
    }
    const std::int64_t cost = cost_(a.vertex, b.vertex);
    if (cost >= duals) return;
    if (cost >= PairCost::kFar) {
      throw std::overflow_error("match_points: the duals overflow 64 bits");
    }
    const std::pair<std::int64_t, std::uint32_t> entry{cost - duals, b.vertex};
    worst.insert(std::upper_bound(worst.begin(), worst.end(), entry), entry);
    if (worst.size() > kMost) worst.pop_back();
  }

  // Tests each pair of different parts once, from the end that leaves the chain first.
  bool faces(std::uint32_t i, std::uint32_t j) const {
    const Member &a = members_[i], &b = members_[j];
    return a.part != b.part && (b.level > a.level || (b.level == a.level && i < j));
  }

  // If two large parts are too close, so are all their pairs. A few of them suffice.
  void choose() {
    std::sort(wanted_.begin(), wanted_.end(), [](const Wanted& a, const Wanted& b) {
      return std::tie(a.part, a.excess, a.from, a.to) < std::tie(b.part, b.excess, b.from, b.to);
    });
    std::uint32_t part = kNone;
    std::size_t taken = 0;
    for (const Wanted& w : wanted_) {
      taken = w.part == part ? taken + 1 : 0;
      part = w.part;
      if (taken >= kMost + nest_.size(part) / 8) continue;
      const std::uint32_t i = members_[w.from].vertex;
      found_.push_back({i, w.to, cost_(i, w.to)});
    }
  }

  void price() {
    std::vector<std::pair<std::int64_t, std::uint32_t>> worst;
    wanted_.clear();
    const auto take = [&](std::uint32_t k) {
      for (const auto& [excess, j] : worst) wanted_.push_back({members_[k].part, k, j, excess});
      worst.clear();
    };
    const auto count = static_cast<std::uint32_t>(members_.size());
    if (count <= 4 * kLeaf) {
      for (std::uint32_t i = 0; i < count; ++i) {
        ticks_(count);
        for (std::uint32_t j = 0; j < count; ++j) {
          if (faces(i, j)) test(members_[i], members_[j], worst);
        }
        take(i);
      }
      choose();
      return;
    }
    std::vector<Point> points(count);
    for (std::uint32_t k = 0; k < count; ++k) points[k] = points_[members_[k].vertex];
    const KdTree<D> tree(std::move(points));
    const auto& nodes = tree.nodes();
    // For each box: the largest potential, and the part if all its points belong to the same one.
    std::vector<std::int64_t> most(nodes.size());
    std::vector<std::uint32_t> part(nodes.size()), deepest(nodes.size());
    for (std::size_t x = nodes.size(); x-- > 0;) {
      const auto& node = nodes[x];
      if (node.right != 0) {
        most[x] = std::max(most[x + 1], most[node.right]);
        deepest[x] = std::max(deepest[x + 1], deepest[node.right]);
        part[x] = part[x + 1] == part[node.right] ? part[x + 1] : kNone;
        continue;
      }
      most[x] = members_[node.begin].potential;
      part[x] = members_[node.begin].part;
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        most[x] = std::max(most[x], members_[k].potential);
        deepest[x] = std::max(deepest[x], members_[k].level);
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
        if (deepest[x] < a.level || (deepest[x] == a.level && node.end <= i + 1) ||
            part[x] == a.part ||
            !cost_.may_violate(node.box.squared_distance(points_[a.vertex]),
                               a.potential + most[x] - 2 * around_[a.level])) {
          continue;
        }
        if (node.right != 0) {
          open.push_back(node.right);
          open.push_back(x + 1);
          continue;
        }
        for (std::uint32_t j = node.begin; j < node.end; ++j) {
          if (faces(i, j)) test(a, members_[j], worst);
        }
      }
      take(i);
    }
    choose();
  }

  std::span<const Point> points_;
  const PairCost& cost_;
  base::StopTicks ticks_;
  Nest nest_;
  std::vector<Head> heads_;
  std::vector<Member> members_;
  // for each level of the chain: the sum of the duals around it, including its own
  std::vector<std::int64_t> around_;
  std::vector<Wanted> wanted_;
  std::vector<Edge> found_;
};

}  // namespace terrace::matching::blossom
