// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

/// The nesting of a solution's nodes from the outside in: the children of each node, and its
/// vertices as a range of one sequence.
class NestingTree {
 public:
  NestingTree() = default;
  explicit NestingTree(const Solver& solver);

  /// Returns the parts of a blossom or, for kNone, the top nodes.
  std::span<const std::uint32_t> children_of(std::uint32_t node) const {
    const std::size_t k = node == kNone ? begin_.size() - 2 : node;
    return std::span(children_).subspan(begin_[k], begin_[k + 1] - begin_[k]);
  }

  std::span<const std::uint32_t> vertices_of(std::uint32_t node) const {
    return std::span(order_).subspan(ranges_[node].begin, size(node));
  }

  std::uint32_t size(std::uint32_t node) const { return ranges_[node].end - ranges_[node].begin; }

 private:
  struct Range {
    std::uint32_t begin = 0, end = 0;
  };

  std::vector<std::uint32_t> begin_, children_, order_;
  std::vector<Range> ranges_;
};

}  // namespace terrace::matching::blossom
