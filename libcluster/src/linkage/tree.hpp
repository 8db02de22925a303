// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/point.hpp"

/// Private to linkage.

namespace terrace::cluster {

/// A kd-tree over points in its own order, in which the points of a node are consecutive. Nodes are
/// numbered as in a heap (root 1, children 2v and 2v + 1). All leaves are on one level, and node q
/// of a level with 2^t nodes has the points from floor(q n / 2^t) on.
class LinkageTree {
 public:
  static constexpr std::size_t kLeaf = 8;  ///< maximum points per leaf

  /// The order depends on the points alone. Takes O(n log n).
  LinkageTree(std::span<const Point3> points, std::span<const std::uint32_t> chosen,
              unsigned threads, const base::StopCheck& check_stop = {});

  [[nodiscard]] std::size_t size() const { return number_.size(); }
  [[nodiscard]] std::size_t leaves() const { return std::size_t{1} << depth_; }
  [[nodiscard]] std::size_t nodes() const { return 2 * leaves(); }  ///< 1 .. nodes() - 1
  [[nodiscard]] std::size_t leaf_node(std::size_t leaf) const { return leaves() + leaf; }
  [[nodiscard]] bool is_leaf(std::size_t node) const { return node >= leaves(); }
  /// Returns the position of the first point of a leaf. leaf_begin(leaf + 1) is its end.
  [[nodiscard]] std::size_t leaf_begin(std::size_t leaf) const { return (leaf * size()) >> depth_; }
  [[nodiscard]] const Box3& box(std::size_t node) const { return boxes_[node]; }
  /// Returns coordinates in tree order. kLeaf extra entries follow, which may be read.
  [[nodiscard]] const double* axis(unsigned a) const { return axes_[a].data(); }
  [[nodiscard]] Point3 point(std::size_t i) const {
    return {axes_[0][i], axes_[1][i], axes_[2][i]};
  }
  /// Returns the input index of the point at position i.
  [[nodiscard]] std::uint32_t number(std::size_t i) const { return number_[i]; }

 private:
  struct Record {
    Point3 p;
    std::uint32_t number;
  };
  void split(std::size_t node, unsigned level, std::vector<Record>& records);
  void split_all(std::size_t node, unsigned level, std::vector<Record>& records,
                 base::StopTicks& ticks);

  unsigned depth_ = 0;
  std::vector<Box3> boxes_;
  std::vector<double> axes_[3];
  std::vector<std::uint32_t> number_;
};

}  // namespace terrace::cluster
