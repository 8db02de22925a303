// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/matching/bounding_volume_hierarchy.hpp"

/// Checks of the trees and boxes that callers pass in.

namespace terrace::matching::tree {

[[noreturn]] inline void refuse_tree(const std::string& what) {
  throw std::invalid_argument("a tree over boxes: " + what);
}

template <std::size_t D>
void check_boxes(std::span<const Box<D>> boxes) {
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    for (std::size_t d = 0; d < D; ++d) {
      if (std::isfinite(boxes[k].lo[d]) && std::isfinite(boxes[k].hi[d]) &&
          boxes[k].lo[d] <= boxes[k].hi[d]) {
        continue;
      }
      refuse_tree(
          "primitive " + std::to_string(k) +
          " has a coordinate that is not finite or a box whose lo exceeds its hi; leave it out");
    }
  }
}

inline void check_rows(std::span<const TreeChildren> rows, std::size_t n) {
  if (n > std::numeric_limits<std::uint32_t>::max() / 2) {
    refuse_tree(std::to_string(n) + " primitives would need about " + std::to_string(n / 13000000) +
                " GB; at most 2^31 - 1 are possible");
  }
  if (rows.size() != (n == 0 ? 0 : n - 1)) {
    refuse_tree(std::to_string(rows.size()) + " rows for " + std::to_string(n) +
                " primitives; a binary tree has one row fewer than leaves");
  }
  std::vector<bool> taken(n + rows.size(), false);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (const std::uint32_t child : {rows[r].a, rows[r].b}) {
      if (child >= n + r || taken[child]) {
        refuse_tree("row " + std::to_string(r) + " names node " + std::to_string(child) +
                    ", which " +
                    (child >= n + r ? "is not made by an earlier row" : "already has a parent"));
      }
      taken[child] = true;
    }
  }
}

}  // namespace terrace::matching::tree
