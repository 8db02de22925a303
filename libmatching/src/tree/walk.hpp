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
    if (depth < inline_.size()) return;
    allocated_.resize(depth + 1);
    entries_ = allocated_.data();
  }
  WalkStack(const WalkStack&) = delete;
  WalkStack& operator=(const WalkStack&) = delete;

  void push(const Entry& entry) { entries_[size_++] = entry; }
  Entry pop() { return entries_[--size_]; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

 private:
  std::array<Entry, 64> inline_;
  std::vector<Entry> allocated_;
  Entry* entries_ = inline_.data();
  std::size_t size_ = 0;
};

/// A query point in the scale of the primitives (`scaled`) and in the frame of the boxes
/// (`in_frame`). The constructor throws std::invalid_argument for a coordinate that is not finite
/// or too large.
template <std::size_t D>
struct QueryPoint {
  std::array<double, D> scaled, in_frame;

  QueryPoint(const std::array<double, D>& point, const HierarchyFrame<D>& frame) {
    for (std::size_t d = 0; d < D; ++d) {
      if (!std::isfinite(point[d])) {
        throw std::invalid_argument("a query's coordinate " + std::to_string(d) +
                                    " is not finite; give a finite point");
      }
      scaled[d] = point[d] * frame.scale;
      in_frame[d] = scaled[d] - frame.centre[d];
      if (std::abs(scaled[d]) > 0x1p460) {
        throw std::invalid_argument("a query's coordinate " + std::to_string(d) +
                                    " is too large for squared distances; scale all points");
      }
    }
  }
};

/// Walks down a hierarchy, the child with the lower key first, and calls leaf(node) for each leaf
/// that may contain a result.
///
/// key(node): a lower bound of the keys of everything inside the node, or infinity if it contains
/// nothing of interest.
/// may_contain(key): true if a node with this key may still contain a result. Once false for a key,
/// it must stay false.
template <std::size_t D, class Key, class Reaches, class Leaf>
void walk(const BoundingVolumeHierarchy<D>& tree, Key&& key, Reaches&& may_contain, Leaf&& leaf) {
  const auto nodes = tree.nodes();
  if (nodes.empty()) return;
  struct Entry {
    double key;
    std::uint32_t node;
  };
  WalkStack<Entry> open(tree.depth());
  Entry at{key(nodes[0]), 0};
  while (true) {
    if (may_contain(at.key)) {
      const auto& node = nodes[at.node];
      if (node.count == 0) {
        Entry near{key(nodes[at.node + 1]), at.node + 1};
        Entry far{key(nodes[node.link]), node.link};
        if (far.key < near.key) std::swap(near, far);
        if (may_contain(far.key)) open.push(far);
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
