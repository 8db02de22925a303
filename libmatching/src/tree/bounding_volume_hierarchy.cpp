// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/bounding_volume_hierarchy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "tree/check.hpp"

namespace terrace::matching {
namespace {

using tree::area_of;

[[noreturn]] void refuse_volumes(const std::string& what) {
  throw std::invalid_argument("BoundingVolumeHierarchy: " + what);
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Returns the nearest float at or below x, one step lower if the subtraction that gave x rounded
// up.
float rounded_down(double x) {
  const double lower = x - std::abs(x) * 0x1p-51;
  const auto f = static_cast<float>(lower);
  return static_cast<double>(f) > lower ? std::nextafterf(f, -kInfinity) : f;
}

float rounded_up(double x) { return -rounded_down(-x); }

/// The union of two such boxes is exact.
template <std::size_t D>
using FloatBox = base::Box<D, float>;

void check_costs(const SurfaceAreaCosts& costs) {
  const auto bad = [](double c) { return !(c >= 0.0) || !std::isfinite(c); };
  if (bad(costs.traversal) || bad(costs.intersection)) {
    refuse_volumes("the costs of the heuristic must be finite and not negative");
  }
}

template <std::size_t D>
HierarchyFrame<D> frame_of(std::span<const base::Box<D>> boxes) {
  HierarchyFrame<D> frame;
  if (boxes.empty()) return frame;
  base::Box<D> all;
  double largest = 0.0;
  for (const base::Box<D>& box : boxes) all.include(box);
  for (std::size_t d = 0; d < D; ++d) {
    largest = std::max({largest, std::abs(all.min[d]), std::abs(all.max[d])});
  }
  if (largest > 0x1p60 || (largest < 0x1p-60 && largest > 0.0)) {
    frame.scale = std::ldexp(1.0, std::clamp(-std::ilogb(largest) - 1, -1000, 1000));
  }
  for (std::size_t d = 0; d < D; ++d) {
    const double lo = all.min[d] * frame.scale, hi = all.max[d] * frame.scale;
    frame.centre[d] = 0.5 * lo + 0.5 * hi;
    frame.reach = std::max({frame.reach, frame.centre[d] - lo, hi - frame.centre[d]});
  }
  return frame;
}

/// Computes the boxes of all nodes and decides which nodes become leaves.
template <std::size_t D>
class Plan {
 public:
  Plan(std::span<const TreeChildren> rows, std::span<const base::Box<D>> boxes,
       const HierarchyOptions& options, const HierarchyFrame<D>& frame)
      : rows_(rows), count_(static_cast<std::uint32_t>(boxes.size())), size_(rows.size()) {
    boxes_.resize(boxes.size() + rows.size());
    std::vector<double> cost(boxes_.size());
    const SurfaceAreaCosts& costs = options.costs;
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      for (std::size_t d = 0; d < D; ++d) {
        boxes_[k].min[d] = rounded_down(boxes[k].min[d] * frame.scale - frame.centre[d]);
        boxes_[k].max[d] = rounded_up(boxes[k].max[d] * frame.scale - frame.centre[d]);
      }
      cost[k] = costs.intersection * area_of(boxes_[k]);
    }
    leaf_.assign(rows.size(), false);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto [a, b] = rows[r];
      const std::size_t v = count_ + r;
      boxes_[v] = boxes_[a];
      boxes_[v].include(boxes_[b]);
      size_[r] = size(a) + size(b);
      const double area = area_of(boxes_[v]);
      cost[v] = costs.traversal * area + cost[a] + cost[b];
      const double as_leaf = costs.intersection * area * static_cast<double>(size_[r]);
      if (size_[r] > options.leaf_size || as_leaf > cost[v]) continue;
      leaf_[r] = true;
      cost[v] = as_leaf;
    }
  }

  [[nodiscard]] bool leaf(std::uint32_t v) const { return v < count_ || leaf_[v - count_]; }
  [[nodiscard]] std::uint32_t size(std::uint32_t v) const {
    return v < count_ ? 1 : size_[v - count_];
  }
  [[nodiscard]] const FloatBox<D>& box(std::uint32_t v) const { return boxes_[v]; }

  /// Puts the larger child first: it is visited more often, and the next node is likely in the
  /// cache.
  [[nodiscard]] TreeChildren children(std::uint32_t v) const {
    const auto [a, b] = rows_[v - count_];
    if (area_of(boxes_[a]) >= area_of(boxes_[b])) return {a, b};
    return {b, a};
  }

  /// Appends the primitives below v.
  void gather(std::uint32_t v, std::vector<std::uint32_t>& order) {
    open_.assign(1, v);
    while (!open_.empty()) {
      const std::uint32_t at = open_.back();
      open_.pop_back();
      if (at < count_) {
        order.push_back(at);
        continue;
      }
      open_.push_back(rows_[at - count_].b);
      open_.push_back(rows_[at - count_].a);
    }
  }

 private:
  std::span<const TreeChildren> rows_;
  std::uint32_t count_;
  std::vector<FloatBox<D>> boxes_;
  std::vector<std::uint32_t> size_, open_;
  std::vector<bool> leaf_;
};

}  // namespace

template <std::size_t D>
BoundingVolumeHierarchy<D>::BoundingVolumeHierarchy(std::span<const TreeChildren> rows,
                                                    std::span<const base::Box<D>> boxes,
                                                    const HierarchyOptions& options) {
  check_costs(options.costs);
  if (options.leaf_size == 0) refuse_volumes("leaf_size is 0; a leaf holds at least one primitive");
  tree::check_rows(rows, boxes.size());
  tree::check_boxes(boxes);
  frame_ = frame_of(boxes);
  if (boxes.empty()) return;
  Plan<D> plan(rows, boxes, options, frame_);
  order_.reserve(boxes.size());
  struct Open {
    std::uint32_t node, parent;
    std::size_t depth;
  };
  constexpr std::uint32_t kFirstChild = std::numeric_limits<std::uint32_t>::max();
  std::vector<Open> open{
      {static_cast<std::uint32_t>(boxes.size() + rows.size() - 1), kFirstChild, 0}};
  while (!open.empty()) {
    const Open at = open.back();
    open.pop_back();
    const auto place = static_cast<std::uint32_t>(nodes_.size());
    if (at.parent != kFirstChild) nodes_[at.parent].link = place;
    const FloatBox<D>& box = plan.box(at.node);
    if (plan.leaf(at.node)) {
      nodes_.push_back(
          {box.min, box.max, static_cast<std::uint32_t>(order_.size()), plan.size(at.node)});
      plan.gather(at.node, order_);
      depth_ = std::max(depth_, at.depth);
      continue;
    }
    nodes_.push_back({box.min, box.max, 0, 0});
    const auto [first, second] = plan.children(at.node);
    open.push_back({second, place, at.depth + 1});
    open.push_back({first, kFirstChild, at.depth + 1});
  }
  nodes_.shrink_to_fit();
}

template <std::size_t D>
double BoundingVolumeHierarchy<D>::surface_area_cost(const SurfaceAreaCosts& costs) const {
  check_costs(costs);
  if (nodes_.empty()) return 0.0;
  const double root = area_of(nodes_[0]);
  double sum = 0.0;
  for (const Node& node : nodes_) {
    const double share = root > 0.0 ? area_of(node) / root : 1.0;
    sum += share * (node.count == 0 ? costs.traversal : costs.intersection * node.count);
  }
  return sum;
}

template class BoundingVolumeHierarchy<2>;
template class BoundingVolumeHierarchy<3>;

}  // namespace terrace::matching
