// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "terrace/matching/bounding_volume_hierarchy.hpp"
#include "tree/check.hpp"

namespace terrace::matching {
namespace {

template <std::size_t D>
class Rotation {
 public:
  Rotation(std::span<const TreeChildren> rows, std::span<const base::Box<D>> boxes)
      : count_(static_cast<std::uint32_t>(boxes.size())),
        children_(rows.begin(), rows.end()),
        boxes_(boxes.begin(), boxes.end()) {
    // Scale by a power of two, so that areas neither overflow nor underflow.
    double largest = 0.0;
    for (const base::Box<D>& box : boxes_) {
      for (std::size_t d = 0; d < D; ++d) {
        largest = std::max({largest, std::abs(box.min[d]), std::abs(box.max[d])});
      }
    }
    if (largest > 0.0) {
      const int exponent = -std::ilogb(largest) - 1;
      for (base::Box<D>& box : boxes_) {
        for (std::size_t d = 0; d < D; ++d) {
          box.min[d] = std::ldexp(box.min[d], exponent);
          box.max[d] = std::ldexp(box.max[d], exponent);
        }
      }
    }
    boxes_.reserve(boxes_.size() + rows.size());
    for (const auto& [a, b] : rows) boxes_.push_back(enclosing_box(a, b));
    for (std::size_t v = count_; v < boxes_.size(); ++v) cost_ += tree::area_of(boxes_[v]);
    set_order();
  }

  /// Makes one pass. Returns whether it gained enough for another one.
  bool pass() {
    double gain = 0.0;
    for (const std::uint32_t v : order_) gain += rotate(v);
    set_order();
    cost_ -= gain;
    return gain > 1e-3 * cost_;
  }

  /// Returns the rows in postorder.
  [[nodiscard]] std::vector<TreeChildren> rows() const {
    std::vector<std::uint32_t> number(boxes_.size());
    for (std::uint32_t i = 0; i < count_; ++i) number[i] = i;
    std::vector<TreeChildren> rows;
    rows.reserve(children_.size());
    for (const std::uint32_t v : order_) {
      number[v] = static_cast<std::uint32_t>(count_ + rows.size());
      const auto [a, b] = children_[v - count_];
      rows.push_back({number[a], number[b]});
    }
    return rows;
  }

 private:
  [[nodiscard]] base::Box<D> enclosing_box(std::uint32_t a, std::uint32_t b) const {
    base::Box<D> box = boxes_[a];
    for (std::size_t d = 0; d < D; ++d) {
      box.min[d] = std::min(box.min[d], boxes_[b].min[d]);
      box.max[d] = std::max(box.max[d], boxes_[b].max[d]);
    }
    return box;
  }

  // Returns whether v is an inner node other than a pair of primitives.
  [[nodiscard]] bool may_change(std::uint32_t v) const {
    if (v < count_) return false;
    const auto [a, b] = children_[v - count_];
    return a >= count_ || b >= count_;
  }

  /// Two nodes that swap places: `first` is a child of `first_parent`, `second` of `second_parent`.
  struct Swap {
    std::uint32_t first_parent = 0, first = 0, second_parent = 0, second = 0;
    double gain = 0.0;
  };

  static std::uint32_t other(const TreeChildren& children, std::uint32_t child) {
    return children.a == child ? children.b : children.a;
  }

  // Makes the best of those swaps below v that shrink the boxes of v's children. Returns the gain.
  double rotate(std::uint32_t v) {
    const auto [a, b] = children_[v - count_];
    Swap best;
    const auto try_swaps = [&](std::uint32_t sibling, std::uint32_t parent) {
      if (!may_change(parent)) return;
      const TreeChildren below = children_[parent - count_];
      for (const std::uint32_t child : {below.a, below.b}) {
        const double gain = tree::area_of(boxes_[parent]) -
                            tree::area_of(enclosing_box(sibling, other(below, child)));
        if (gain > best.gain) best = {v, sibling, parent, child, gain};
      }
    };
    try_swaps(a, b);
    try_swaps(b, a);
    if (may_change(a) && may_change(b)) {
      const TreeChildren left = children_[a - count_], right = children_[b - count_];
      const double current_area = tree::area_of(boxes_[a]) + tree::area_of(boxes_[b]);
      for (const std::uint32_t child : {right.a, right.b}) {
        const double gain = current_area -
                            tree::area_of(enclosing_box(left.a, other(right, child))) -
                            tree::area_of(enclosing_box(child, left.b));
        if (gain > best.gain) best = {a, left.a, b, child, gain};
      }
    }
    // A smaller gain would be rounding error.
    if (!(best.gain > 1e-12 * tree::area_of(boxes_[v]))) return 0.0;
    replace(best.first_parent, best.first, best.second);
    replace(best.second_parent, best.second, best.first);
    for (const std::uint32_t parent : {best.first_parent, best.second_parent}) {
      if (parent == v) continue;
      const auto [first, second] = children_[parent - count_];
      boxes_[parent] = enclosing_box(first, second);
    }
    return best.gain;
  }

  void replace(std::uint32_t parent, std::uint32_t child, std::uint32_t replacement) {
    TreeChildren& children = children_[parent - count_];
    (children.a == child ? children.a : children.b) = replacement;
  }

  // Lists parents before children from the root, then reverses the list.
  void set_order() {
    order_.clear();
    if (children_.empty()) return;
    order_.reserve(children_.size());
    std::vector<std::uint32_t> open{static_cast<std::uint32_t>(boxes_.size() - 1)};
    while (!open.empty()) {
      const std::uint32_t v = open.back();
      open.pop_back();
      order_.push_back(v);
      const auto [a, b] = children_[v - count_];
      for (const std::uint32_t child : {b, a}) {
        if (child >= count_) open.push_back(child);
      }
    }
    std::reverse(order_.begin(), order_.end());
  }

  std::uint32_t count_;
  std::vector<TreeChildren> children_;
  std::vector<base::Box<D>> boxes_;
  std::vector<std::uint32_t> order_;  // inner nodes, children before parents
  double cost_ = 0.0;                 // sum of the inner nodes' areas
};

}  // namespace

template <std::size_t D>
std::vector<TreeChildren> rotate_tree(std::span<const TreeChildren> rows,
                                      std::span<const base::Box<D>> boxes, unsigned passes) {
  tree::check_rows(rows, boxes.size());
  tree::check_boxes(boxes);
  Rotation<D> rotation(rows, boxes);
  while (passes-- > 0 && rotation.pass()) {
  }
  return rotation.rows();
}

template std::vector<TreeChildren> rotate_tree<2>(std::span<const TreeChildren>,
                                                  std::span<const base::Box2>, unsigned);
template std::vector<TreeChildren> rotate_tree<3>(std::span<const TreeChildren>,
                                                  std::span<const base::Box3>, unsigned);

}  // namespace terrace::matching
