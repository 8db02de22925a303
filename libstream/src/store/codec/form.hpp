// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "store/codec/coding.hpp"
#include "store/codec/split.hpp"

/// The head of a cluster's byte string, which says how its positions are coded and in which box.

namespace terrace::stream::store {

/// If set, positions are coded by SplitEncoder; otherwise as rows (GridCodec) or as three columns.
inline constexpr unsigned kSplitForm = 1;
inline constexpr unsigned kOwnBoxForm = 2;  ///< a box smaller than the entry's follows

/// Codes a box as insets from `outer` on both sides of each axis, in the same frame.
template <class Coder>
void code_box(Coder& coder, const IntegerBox& outer, IntegerBox& box) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    std::uint64_t below = box.low[axis] - outer.low[axis];
    std::uint64_t above = outer.size[axis] - box.size[axis] - below;
    code_number(coder, context::kInset + 2 * axis, below);
    code_number(coder, context::kInset + 2 * axis + 1, above);
    if constexpr (Coder::kDecoding) {
      if (below >= outer.size[axis] || above >= outer.size[axis] - below) {
        throw Damage("a cluster's own box is not inside its index entry's");
      }
      box.low[axis] = outer.low[axis] + below;
      box.size[axis] = outer.size[axis] - below - above;
    }
  }
}

}  // namespace terrace::stream::store
