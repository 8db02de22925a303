// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "linkage/tree.hpp"

/// Private to single linkage.

namespace terrace::cluster {

/// An edge between two positions of a tree, with its squared length. Edges are ordered by length,
/// then by position. So no two edges are equal, and the minimum spanning tree is unique.
struct TreeEdge {
  double square;
  std::uint32_t low, high;  ///< low < high

  static TreeEdge of(double square, std::uint32_t i, std::uint32_t j) {
    return i < j ? TreeEdge{square, i, j} : TreeEdge{square, j, i};
  }
  friend bool operator<(const TreeEdge& x, const TreeEdge& y) {
    if (x.square != y.square) return x.square < y.square;
    return x.low != y.low ? x.low < y.low : x.high < y.high;
  }
};

/// The nearest other points of each point of a tree, by position and in the order of TreeEdge.
class NeighbourLists {
 public:
  static constexpr unsigned kMaxLength = 8;

  NeighbourLists(const LinkageTree& tree, unsigned threads, const base::StopCheck& check_stop);
  /// Returns the length of each list: kMaxLength, or the number of all other points if that is
  /// less.
  [[nodiscard]] unsigned length() const { return length_; }
  [[nodiscard]] std::uint32_t* list(std::size_t position) {
    return lists_.data() + position * length_;
  }

 private:
  void search(const LinkageTree& tree, std::size_t leaf);

  unsigned length_;
  std::vector<std::uint32_t> lists_;
};

}  // namespace terrace::cluster
