// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Trees of boxes of consecutive numbers, all in one array. Efficient if consecutive boxes are near
/// each other.
class BoxForest {
 public:
  struct Tree {
    std::uint32_t root = 0, end = 0;  ///< range of nodes
    bool is_built = false;
  };

  void clear() { nodes_.clear(); }
  /// Adds a tree of the numbers from begin to end. halve(begin, middle, end) is called before a
  /// range is halved and may reorder its numbers. O(n) without that.
  template <class BoxOf, class Halve>
  Tree add(std::uint32_t begin, std::uint32_t end, std::uint32_t per_leaf, const BoxOf& box_of,
           const Halve& halve) {
    const auto root = static_cast<std::uint32_t>(nodes_.size());
    if (begin < end) add_node(begin, end, per_leaf, box_of, halve);
    return {root, static_cast<std::uint32_t>(nodes_.size()), true};
  }

  /// Calls visit(number) for the numbers of each leaf for whose box may(box) is true, as it must be
  /// for every box around it.
  template <class May, class Visit>
  void visit(const Tree& tree, const May& may, const Visit& visit) const {
    for (std::uint32_t at = tree.root; at < tree.end;) {
      const Node& node = nodes_[at];
      const bool looks = may(node.box);
      at = looks ? at + 1 : node.next;
      for (std::uint32_t i = node.begin; looks && i < node.end; ++i) visit(i);
    }
  }

  [[nodiscard]] std::size_t memory_bytes() const { return nodes_.capacity() * sizeof(Node); }

 private:
  /// A node, followed by its descendants up to index `next`.
  struct Node {
    StoredBox box;
    std::uint32_t begin = 0, end = 0;  ///< range of numbers in a leaf
    std::uint32_t next = 0;
  };

  /// Returns the box around the numbers.
  template <class BoxOf, class Halve>
  StoredBox add_node(std::uint32_t begin, std::uint32_t end, std::uint32_t per_leaf,
                     const BoxOf& box_of, const Halve& halve) {
    StoredBox box;
    const std::size_t at = nodes_.size();
    nodes_.push_back({});
    if (end - begin <= per_leaf) {
      for (std::uint32_t i = begin; i < end; ++i) box.include(box_of(i));
      nodes_[at].begin = begin;
      nodes_[at].end = end;
    } else {
      const std::uint32_t middle = begin + (end - begin) / 2;
      halve(begin, middle, end);
      box.include(add_node(begin, middle, per_leaf, box_of, halve));
      box.include(add_node(middle, end, per_leaf, box_of, halve));
    }
    nodes_[at].box = box;
    nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
    return box;
  }

  std::vector<Node> nodes_;
};

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
    tree_ = {};
    return items_;
  }
  /// Builds the tree from the boxes. O(n).
  void build() {
    constexpr std::uint32_t kItemsPerLeaf = 4;
    tree_ = nodes_.add(
        0, static_cast<std::uint32_t>(items_.size()), kItemsPerLeaf,
        [&](std::uint32_t i) { return items_[i].box; },
        [](std::uint32_t, std::uint32_t, std::uint32_t) {});
  }

  /// Calls visit(number) for each box for which may(box) is true, as it must be for every box
  /// around it.
  template <class May, class Visit>
  void visit(const May& may, const Visit& visit) const {
    nodes_.visit(tree_, may, [&](std::uint32_t i) {
      if (may(items_[i].box)) visit(items_[i].number);
    });
  }

  [[nodiscard]] std::size_t memory_bytes() const {
    return items_.capacity() * sizeof(Item) + nodes_.memory_bytes();
  }

 private:
  std::vector<Item> items_;
  BoxForest nodes_;
  BoxForest::Tree tree_;
};

}  // namespace terrace::terrain
