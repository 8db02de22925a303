// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "base/decimal_multiples.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The multiples of an interval, and where they cross triangles. A level crosses an edge if one end
/// is above it and the other is not. So a corner at a level counts as below it, a plateau has a
/// line only around its upper side, and a triangle crossed by a level has one segment of it.
class ContourLevels {
 public:
  /// interval: positive. Heights must be within 2^50 intervals. by_rows: places are the same to the
  /// last bit as ContourLines computes them on the edges of a lattice.
  explicit ContourLevels(double interval, bool by_rows = false)
      : heights_(interval), by_rows_(by_rows) {}

  [[nodiscard]] double height(std::int64_t level) const { return heights_(level); }

  /// Returns the lowest level that is not below a height. All levels below it are below the height.
  [[nodiscard]] std::int64_t at_or_above(double height) const {
    auto level = static_cast<std::int64_t>(std::ceil(height / heights_.step()));
    // The quotient is rounded, so compare the height with the heights of the levels.
    while (this->height(level) < height) ++level;
    while (this->height(level - 1) >= height) --level;
    return level;
  }

  /// Calls segment(level, apex, right, left) for every level that crosses the counter-clockwise
  /// triangle a, b, c. The segment from the edge apex-right to the edge apex-left has higher ground
  /// on its left. A Corner has a `level`, the at_or_above() of its height.
  template <class Corner, class Segment>
  static void cross(const Corner& a, const Corner& b, const Corner& c, const Segment& segment) {
    const std::array<const Corner*, 3> corner{&a, &b, &c};
    const auto [low, high] = std::minmax({a.level, b.level, c.level});
    for (std::int64_t level = low; level < high; ++level) {
      // Find the corner that is alone on its side of the level.
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

  /// Returns the place where a level crosses the edge between p and q with these heights, with the
  /// same bits for both triangles at the edge.
  [[nodiscard]] Point2 place(std::int64_t level, const Point2& p, double p_height, const Point2& q,
                             double q_height) const {
    const bool is_first = by_rows_ ? std::pair(q[1], q[0]) < std::pair(p[1], p[0]) : q < p;
    if (is_first) return place(level, q, q_height, p, p_height);
    const double t = share(level, p_height, q_height);
    // An end at the level is met exactly, from either side.
    return t == 1 ? q : Point2{p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
  }

  /// Returns the position of the level between `from` and `to`, 0 to 1; the level must cross the
  /// edge.
  [[nodiscard]] double share(std::int64_t level, double from, double to) const {
    return (height(level) - from) / (to - from);
  }

 private:
  DecimalMultiples heights_;
  bool by_rows_;  ///< starts at the end of an edge in the smaller row, not in the smaller column
};

}  // namespace terrace::terrain
