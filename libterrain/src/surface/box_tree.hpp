// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Numbered boxes in a tree, halved across the longer side of what is around them.
class BoxTree {
 public:
  struct Item {
    StoredBox box;
    std::uint32_t number = 0;
  };

  /// The boxes to be, to be filled by the caller; build() must follow. Forgets the others.
  std::vector<Item>& start() {
    items_.clear();
    nodes_.clear();
    return items_;
  }
  /// O(n log n).
  void build() {
    if (!items_.empty()) add(0, static_cast<std::uint32_t>(items_.size()));
  }

  /// Calls visit(number) for each box for which may(box) is true, and that of all boxes around it.
  template <class May, class Visit>
  void visit(const May& may, const Visit& visit) const {
    for (std::size_t at = 0; at < nodes_.size();) {
      const Node& node = nodes_[at];
      if (!may(node.box)) {
        at = node.next;
        continue;
      }
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        if (may(items_[i].box)) visit(items_[i].number);
      }
      ++at;
    }
  }

  [[nodiscard]] std::size_t memory_bytes() const {
    return items_.capacity() * sizeof(Item) + nodes_.capacity() * sizeof(Node);
  }

 private:
  static constexpr std::uint32_t kItemsPerLeaf = 4;
  /// What is below follows, up to `next`.
  struct Node {
    StoredBox box;
    std::uint32_t begin = 0, end = 0;  ///< items of a leaf
    std::uint32_t next = 0;
  };

  void add(std::uint32_t begin, std::uint32_t end) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    StoredBox box{{kFar, kFar}, {-kFar, -kFar}};
    const std::span<Item> items(items_.data() + begin, end - begin);
    for (const Item& item : items) {
      for (std::size_t k = 0; k < 2; ++k) {
        box.min[k] = std::min(box.min[k], item.box.min[k]);
        box.max[k] = std::max(box.max[k], item.box.max[k]);
      }
    }
    const std::size_t at = nodes_.size();
    const bool is_leaf = items.size() <= kItemsPerLeaf;
    nodes_.push_back({box, begin, is_leaf ? end : begin, 0});
    if (!is_leaf) {
      const std::size_t axis = box.max[0] - box.min[0] >= box.max[1] - box.min[1] ? 0 : 1;
      const std::uint32_t half = (end - begin) / 2;
      std::nth_element(
          items.begin(), items.begin() + half, items.end(), [axis](const Item& a, const Item& b) {
            return a.box.min[axis] + a.box.max[axis] < b.box.min[axis] + b.box.max[axis];
          });
      add(begin, begin + half);
      add(begin + half, end);
    }
    nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
  }

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

}  // namespace terrace::terrain
