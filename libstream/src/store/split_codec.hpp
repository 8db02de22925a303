// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "coding.hpp"

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
  struct Point {
    std::array<std::uint64_t, 3> at{};
    std::uint32_t number = 0;  ///< the encoder's, which tells the order of coding
  };

  /// Encoding re-orders points; decoding fills them. All lie in `box`.
  template <class Coder>
  void code(Coder& coder, const IntegerBox& box, std::vector<Point>& points) {
    split(coder, box, points.data(), static_cast<std::uint32_t>(points.size()));
  }

 private:
  template <class Coder>
  void split(Coder& coder, IntegerBox box, Point* points, std::uint32_t n) {
    // The lower half recursively, the upper one by going round: at most 192 deep.
    while (n > 1) {
      std::size_t axis = box.size[1] > box.size[0] ? 1 : 0;
      if (box.size[2] > box.size[axis]) axis = 2;
      if (box.size[axis] == 1) {
        if constexpr (Coder::kDecoding) {
          for (std::uint32_t i = 0; i < n; ++i) points[i].at = box.low;
        } else {
          std::sort(points, points + n,
                    [](const Point& a, const Point& b) { return a.number < b.number; });
        }
        return;
      }
      const std::uint64_t lower = box.size[axis] - box.size[axis] / 2;
      const std::uint64_t middle = box.low[axis] + lower;
      std::uint32_t below = 0;
      if constexpr (!Coder::kDecoding) {
        below = static_cast<std::uint32_t>(
            std::partition(points, points + n,
                           [&](const Point& p) { return p.at[axis] < middle; }) -
            points);
      }
      code_count(coder, n, below);

      IntegerBox half = box;
      half.size[axis] = lower;
      if (below > 0) split(coder, half, points, below);
      box.low[axis] = middle;
      box.size[axis] -= lower;
      points += below;
      n -= below;
    }
    if (n == 1) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (box.size[axis] == 1) {
          if constexpr (Coder::kDecoding) points->at[axis] = box.low[axis];
          continue;
        }
        std::uint64_t value = points->at[axis] - box.low[axis];
        code_uniform(coder, value, box.size[axis]);
        if constexpr (Coder::kDecoding) points->at[axis] = box.low[axis] + value;
      }
    }
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
};

}  // namespace terrace::stream::store
