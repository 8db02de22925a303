// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "terrace/matching/bounding_volume_hierarchy.hpp"

/// Checks of the trees and boxes that callers pass in, and the area of a box.

namespace terrace::matching::tree {

[[noreturn]] inline void refuse_tree(const std::string& what) {
  throw std::invalid_argument("a tree over boxes: " + what);
}

/// Throws std::invalid_argument for a box that is not finite or whose min exceeds its max.
template <std::size_t D>
void check_boxes(std::span<const base::Box<D>> boxes) {
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    for (std::size_t d = 0; d < D; ++d) {
      if (std::isfinite(boxes[k].min[d]) && std::isfinite(boxes[k].max[d]) &&
          boxes[k].min[d] <= boxes[k].max[d]) {
        continue;
      }
      refuse_tree(
          "primitive " + std::to_string(k) +
          " has a coordinate that is not finite or a box whose min exceeds its max; leave it out");
    }
  }
}

/// Throws std::invalid_argument if the rows are not a binary tree over n primitives.
inline void check_rows(std::span<const TreeChildren> rows, std::size_t n) {
  if (n > std::numeric_limits<std::uint32_t>::max() / 2) {
    refuse_tree(std::to_string(n) + " primitives would need about " + std::to_string(n / 13000000) +
                " GB; at most 2^31 - 1 are possible");
  }
  if (rows.size() != (n == 0 ? 0 : n - 1)) {
    refuse_tree(std::to_string(rows.size()) + " rows for " + std::to_string(n) +
                " primitives; a binary tree has one row fewer than leaves");
  }
  std::vector<bool> has_parent(n + rows.size(), false);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (const std::uint32_t child : {rows[r].a, rows[r].b}) {
      if (child >= n + r || has_parent[child]) {
        refuse_tree("row " + std::to_string(r) + " names node " + std::to_string(child) +
                    ", which " +
                    (child >= n + r ? "is not made by an earlier row" : "already has a parent"));
      }
      has_parent[child] = true;
    }
  }
}

/// Returns the surface area of a box, or its perimeter in the plane.
template <class AnyBox>
double area_of(const AnyBox& box) {
  std::array<double, std::tuple_size_v<decltype(box.min)>> side;
  for (std::size_t d = 0; d < side.size(); ++d) {
    side[d] = static_cast<double>(box.max[d]) - static_cast<double>(box.min[d]);
  }
  if constexpr (side.size() == 2) {
    return 2.0 * (side[0] + side[1]);
  } else {
    return 2.0 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]);
  }
}

}  // namespace terrace::matching::tree
