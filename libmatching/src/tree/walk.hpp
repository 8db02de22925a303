// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "terrace/matching/bounding_volume_hierarchy.hpp"

/// Branch-and-bound traversal of a hierarchy, nearer child first.

namespace terrace::matching::tree {

/// Stack of nodes to visit. Matching trees are shallow, but other trees may have any depth.
template <class Entry>
class WalkStack {
 public:
  explicit WalkStack(std::size_t depth) {
    if (depth < few_.size()) return;
    many_.resize(depth + 1);
    at_ = many_.data();
  }
  WalkStack(const WalkStack&) = delete;
  WalkStack& operator=(const WalkStack&) = delete;

  void push(const Entry& entry) { at_[size_++] = entry; }
  Entry pop() { return at_[--size_]; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

 private:
  std::array<Entry, 64> few_;
  std::vector<Entry> many_;
  Entry* at_ = few_.data();
  std::size_t size_ = 0;
};

/// A point in the units of the primitives and in the units of the boxes.
template <std::size_t D>
struct FramedPlace {
  std::array<double, D> scaled, framed;

  FramedPlace(const std::array<double, D>& place, const HierarchyFrame<D>& frame) {
    for (std::size_t d = 0; d < D; ++d) {
      if (!std::isfinite(place[d])) {
        throw std::invalid_argument("a query's coordinate " + std::to_string(d) +
                                    " is not finite; give a finite point");
      }
      scaled[d] = place[d] * frame.scale;
      framed[d] = scaled[d] - frame.centre[d];
      if (std::abs(scaled[d]) > 0x1p460) {
        throw std::invalid_argument("a query's coordinate " + std::to_string(d) +
                                    " is too large for squared distances; scale all points");
      }
    }
  }
};

/// Walks down a hierarchy, the child with the lower key first. key(node) is a number that is not
/// greater for a node than for what is inside it, infinity if there is nothing. reaches(key) is
/// whether nodes of that key still matter; once false it stays false. Calls leaf(node) for each
/// leaf that matters.
template <std::size_t D, class Key, class Reaches, class Leaf>
void walk(const BoundingVolumeHierarchy<D>& tree, Key&& key, Reaches&& reaches, Leaf&& leaf) {
  const auto nodes = tree.nodes();
  if (nodes.empty()) return;
  struct Entry {
    double key;
    std::uint32_t node;
  };
  WalkStack<Entry> open(tree.depth());
  Entry at{key(nodes[0]), 0};
  while (true) {
    if (reaches(at.key)) {
      const auto& node = nodes[at.node];
      if (node.count == 0) {
        Entry near{key(nodes[at.node + 1]), at.node + 1};
        Entry far{key(nodes[node.link]), node.link};
        if (far.key < near.key) std::swap(near, far);
        if (reaches(far.key)) open.push(far);
        at = near;
        continue;
      }
      leaf(node);
    }
    if (open.empty()) return;
    at = open.pop();
  }
}

}  // namespace terrace::matching::tree
