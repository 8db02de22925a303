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

/// Factor for comparisons with a box's bound. It keeps rounding from pruning wrongly: the squared
/// distances of a box and of a primitive inside it are both accurate to about 2^-50.
inline constexpr double kSlack = 1.0 - 0x1p-47;

template <class AnyBox, std::size_t D>
double squared_distance(const AnyBox& box, const std::array<double, D>& p) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) {
    const double below = static_cast<double>(box.lo[d]) - p[d];
    const double above = p[d] - static_cast<double>(box.hi[d]);
    const double out = std::max(std::max(below, above), 0.0);
    sum += out * out;
  }
  return sum;
}

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

/// Calls leaf(node) for each leaf whose squared distance is at most bound(), nearer leaves first.
template <std::size_t D, class Leaf, class Bound>
void walk_near(const BoundingVolumeHierarchy<D>& tree, const std::array<double, D>& framed,
               Leaf&& leaf, Bound&& bound) {
  const auto nodes = tree.nodes();
  if (nodes.empty()) return;
  struct Entry {
    double distance;
    std::uint32_t node;
  };
  WalkStack<Entry> open(tree.depth());
  Entry at{0.0, 0};
  while (true) {
    if (at.distance * kSlack <= bound()) {
      const auto& node = nodes[at.node];
      if (node.count == 0) {
        Entry near{squared_distance(nodes[at.node + 1], framed), at.node + 1};
        Entry far{squared_distance(nodes[node.link], framed), node.link};
        if (far.distance < near.distance) std::swap(near, far);
        if (far.distance * kSlack <= bound()) open.push(far);
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
