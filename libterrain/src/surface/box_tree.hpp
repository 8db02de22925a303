// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// A tree of numbered boxes; efficient if consecutive boxes are near each other.
class BoxTree {
 public:
  struct Item {
    StoredBox box;
    std::uint32_t number = 0;
  };

  /// Returns the list of boxes for the caller to fill; build() must follow. Clears the tree.
  std::vector<Item>& start() {
    items_.clear();
    nodes_.clear();
    return items_;
  }
  /// Builds the tree from the boxes. O(n).
  void build() {
    if (!items_.empty()) add(0, static_cast<std::uint32_t>(items_.size()));
  }

  /// Calls visit(number) for each box for which may(box) is true, as it must be for every box
  /// around it.
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
  /// A node, followed by its descendants up to index `next`.
  struct Node {
    StoredBox box;
    std::uint32_t begin = 0, end = 0;  ///< range of items in a leaf
    std::uint32_t next = 0;
  };

  /// Adds a subtree of items and returns the box around them.
  StoredBox add(std::uint32_t begin, std::uint32_t end) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    StoredBox box{{kFar, kFar}, {-kFar, -kFar}};
    const auto include = [&box](const StoredBox& other) {
      for (std::size_t k = 0; k < 2; ++k) {
        box.min[k] = std::min(box.min[k], other.min[k]);
        box.max[k] = std::max(box.max[k], other.max[k]);
      }
    };
    const std::size_t at = nodes_.size();
    nodes_.push_back({});
    if (end - begin <= kItemsPerLeaf) {
      for (std::uint32_t i = begin; i < end; ++i) include(items_[i].box);
      nodes_[at].begin = begin;
      nodes_[at].end = end;
    } else {
      const std::uint32_t middle = begin + (end - begin) / 2;
      include(add(begin, middle));
      include(add(middle, end));
    }
    nodes_[at].box = box;
    nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
    return box;
  }

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

}  // namespace terrace::terrain
