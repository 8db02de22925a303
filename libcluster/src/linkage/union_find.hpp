// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace terrace::cluster {

/// Disjoint sets of 0..n-1; the lowest member represents its set. Private to linkage.
class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  [[nodiscard]] std::uint32_t find(std::uint32_t x) {
    while (parent_[x] != x) {
      parent_[x] = parent_[parent_[x]];  // path halving
      x = parent_[x];
    }
    return x;
  }
  /// After calls for all members in ascending order root() takes one step for each.
  void flatten(std::uint32_t x) { parent_[x] = parent_[parent_[x]]; }
  /// The root of a flattened member. Read-only: safe to call from several threads at once.
  [[nodiscard]] std::uint32_t root(std::uint32_t x) const { return parent_[x]; }
  /// False if they were already in one set.
  bool unite(std::uint32_t x, std::uint32_t y) {
    x = find(x);
    y = find(y);
    if (x == y) return false;
    if (x > y) std::swap(x, y);
    parent_[y] = x;
    return true;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace terrace::cluster
