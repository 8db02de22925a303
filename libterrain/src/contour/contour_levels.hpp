// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/decimal_multiples.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The multiples of an interval, and where they cross triangles: a level crosses an edge if one end
/// lies above it and the other does not. So a corner at a level counts as below it, a plateau has a
/// line around its upper side only, and a triangle that a level crosses has one segment of it.
class ContourLevels {
 public:
  /// interval: above 0. Heights must be within 2^50 intervals.
  explicit ContourLevels(double interval) : heights_(interval) {}

  [[nodiscard]] double height(std::int64_t level) const { return heights_(level); }

  /// The lowest level that is not below a height: those below this one lie under the height.
  [[nodiscard]] std::int64_t at_or_above(double height) const {
    auto level = static_cast<std::int64_t>(std::ceil(height / heights_.step()));
    // The quotient is rounded; the level, as it is written, decides.
    while (this->height(level) < height) ++level;
    while (this->height(level - 1) >= height) --level;
    return level;
  }

  /// Calls segment(level, apex, right, left) for every level that crosses the triangle a, b, c,
  /// given counter-clockwise: a segment from the edge apex-right to the edge apex-left has higher
  /// ground on its left. A Corner has a `level`, at_or_above() its height.
  template <class Corner, class Segment>
  static void cross(const Corner& a, const Corner& b, const Corner& c, const Segment& segment) {
    const std::array<const Corner*, 3> corner{&a, &b, &c};
    const auto [low, high] = std::minmax({a.level, b.level, c.level});
    for (std::int64_t level = low; level < high; ++level) {
      // The one that is alone on its side of the level.
      const std::array<bool, 3> above{a.level > level, b.level > level, c.level > level};
      const std::size_t alone = above[1] == above[2] ? 0 : above[0] == above[2] ? 1 : 2;
      const Corner& next = *corner[(alone + 1) % 3];
      const Corner& previous = *corner[(alone + 2) % 3];
      if (above[alone]) {
        segment(level, *corner[alone], next, previous);
      } else {
        segment(level, *corner[alone], previous, next);
      }
    }
  }

  /// Where a level crosses the edge between p and q, which have these heights: the same bits for
  /// both triangles at the edge.
  [[nodiscard]] Point2 place(std::int64_t level, const Point2& p, double p_height, const Point2& q,
                             double q_height) const {
    if (q < p) return place(level, q, q_height, p, p_height);
    const double t = share(level, p_height, q_height);
    // An end at the level is met exactly, from whatever side.
    return t == 1 ? q : Point2{p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
  }

  /// How far from `from` to `to` the level lies, 0 to 1; the edge must be crossed.
  [[nodiscard]] double share(std::int64_t level, double from, double to) const {
    return (height(level) - from) / (to - from);
  }

 private:
  DecimalMultiples heights_;
};

}  // namespace terrace::terrain
