// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace terrace::base {

/// Disjoint sets of the numbers 0 .. n-1. The smallest member represents its set, so the result
/// does not depend on the order of the unions. Amortised O(log n) per call.
class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count), sets_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  /// Returns the smallest member of the set that contains x.
  [[nodiscard]] std::uint32_t find(std::uint32_t x) {
    while (parent_[x] != x) {
      parent_[x] = parent_[parent_[x]];  // path halving
      x = parent_[x];
    }
    return x;
  }
  /// Joins the sets of x and y. Returns false if they already were the same set.
  bool unite(std::uint32_t x, std::uint32_t y) {
    x = find(x);
    y = find(y);
    if (x == y) return false;
    if (x > y) std::swap(x, y);
    parent_[y] = x;
    --sets_;
    return true;
  }
  /// Returns the number of sets.
  [[nodiscard]] std::size_t sets() const { return sets_; }

  /// Makes flat() valid for x. Must be called for all members in ascending order.
  void flatten(std::uint32_t x) { parent_[x] = parent_[parent_[x]]; }
  /// Returns find(x) for a flattened member. Several threads may call it at once.
  [[nodiscard]] std::uint32_t flat(std::uint32_t x) const { return parent_[x]; }

 private:
  std::vector<std::uint32_t> parent_;
  std::size_t sets_;
};

}  // namespace terrace::base
