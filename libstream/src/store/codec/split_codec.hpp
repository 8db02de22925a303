// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/coding.hpp"

/// A multiset of points in a box of integers, in no order: the box is halved across its longest
/// side again and again, and the number of points in the lower half is coded, until one point is
/// left in a box (its place there follows, evenly coded) or the box is one cell.
/// Source: O. Devillers, P.-M. Gandoin, Geometric compression for interactive transmission, IEEE
/// Visualization 2000, doi:10.1109/VISUAL.2000.885711 (static tables by number of points here).

namespace terrace::stream::store {

struct IntegerBox {
  std::array<std::uint64_t, 3> low{};
  std::array<std::uint64_t, 3> size{1, 1, 1};  ///< low + size is the first value beyond
};

class SplitCodec {
 public:
  /// n points in `box`, coordinate by coordinate in `at`. Decoding fills `at`; encoding fills
  /// `order` with the numbers of the points in the order of coding (points at one place:
  /// ascending).
  template <class Coder>
  void code(Coder& shared, const IntegerBox& box, const std::array<std::uint64_t*, 3>& at,
            std::uint32_t* order, std::uint32_t n) {
    at_ = at;
    order_ = order;
    if constexpr (!Coder::kDecoding) {
      if (upper_.size() < n) upper_.resize(n);
      for (std::uint32_t i = 0; i < n; ++i) order[i] = i;
    }
    split(shared, box, 0, n);
  }

 private:
  template <class Coder>
  void split(Coder& coder, IntegerBox box, std::uint32_t first, std::uint32_t n) {
    // The lower half recursively, the upper one by going round: at most 192 deep.
    while (n > 1) {
      std::size_t axis = box.size[1] > box.size[0] ? 1 : 0;
      if (box.size[2] > box.size[axis]) axis = 2;
      if (box.size[axis] == 1) {
        if constexpr (Coder::kDecoding) {
          for (std::size_t a = 0; a < 3; ++a) std::fill_n(at_[a] + first, n, box.low[a]);
        }
        return;
      }
      const std::uint64_t lower = box.size[axis] - box.size[axis] / 2;
      const std::uint64_t middle = box.low[axis] + lower;
      std::uint32_t below = 0;
      if constexpr (!Coder::kDecoding) below = partition(first, n, axis, middle);
      code_count(coder, n, below);

      IntegerBox half = box;
      half.size[axis] = lower;
      if (below > 0) split(coder, half, first, below);
      box.low[axis] = middle;
      box.size[axis] -= lower;
      first += below;
      n -= below;
    }
    if (n == 1) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::uint64_t value = 0;
        if constexpr (!Coder::kDecoding) value = at_[axis][order_[first]] - box.low[axis];
        if (box.size[axis] > 1) code_uniform(coder, value, box.size[axis]);
        if constexpr (Coder::kDecoding) at_[axis][first] = box.low[axis] + value;
      }
    }
  }

  /// Brings the points below `middle` to the front, keeping the order of both parts, and returns
  /// their number. Writes to both parts and counts in one: a branch here is a coin toss.
  std::uint32_t partition(std::uint32_t first, std::uint32_t n, std::size_t axis,
                          std::uint64_t middle) {
    std::uint32_t* const points = order_ + first;
    std::uint32_t* const upper = upper_.data();
    const std::uint64_t* const values = at_[axis];
    std::uint32_t below = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t point = points[i];
      points[below] = point;
      upper[i - below] = point;
      below += values[point] < middle;
    }
    std::copy_n(upper, n - below, points + below);
    return below;
  }

  template <class Coder>
  static void code_count(Coder& coder, std::uint32_t n, std::uint32_t& below) {
    if (n < context::kSplitDirect) {
      unsigned symbol = below;
      code_symbol(coder, context::kSplit + n - 2, symbol);
      below = symbol;
    } else {
      const unsigned width = static_cast<unsigned>(std::bit_width(n));
      const std::int64_t half = n / 2;
      std::uint64_t number = zigzag(std::int64_t{below} - half);
      code_number(coder, context::kSplitWide + std::min(width - 6, 23u), number);
      const std::uint64_t value = static_cast<std::uint64_t>(half + unzigzag(number));
      below = value > n ? n + 1 : static_cast<std::uint32_t>(value);
    }
    if constexpr (Coder::kDecoding) {
      if (below > n) throw Damage("a part of a cluster has more points than the whole");
    }
  }

  std::array<std::uint64_t*, 3> at_{};
  std::uint32_t* order_ = nullptr;
  std::vector<std::uint32_t> upper_;  ///< of a partition under way
};

}  // namespace terrace::stream::store
