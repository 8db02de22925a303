// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Returns the strictly convex hull of points, counter-clockwise from its least corner in x, then
/// y; exact. With `keep_straight`, points on its sides are corners too; of equal points one
/// remains. Fewer than three corners mean that all points are equal or on one line. O(n log n).
/// Source: A. M. Andrew, Another efficient algorithm for convex hulls in two dimensions (1979),
/// doi:10.1016/0020-0190(79)90072-3.
std::vector<Point2> convex_hull(std::vector<Point2> points, bool keep_straight = false);

/// Returns where the line `axis` = c (0: x, 1: y) enters and leaves a convex polygon, the lower
/// place first. Each is on the polygon's border, or outside by a rounding error, so that the inner
/// part of the line is between them. nullopt if the line misses the polygon. hull: from
/// convex_hull(), with a positive area. O(corners).
std::optional<std::array<double, 2>> crossings(std::span<const Point2> hull, unsigned axis,
                                               double c);

/// The hull of points added one by one, in memory of a few times its corners.
class StreamingHull {
 public:
  void add(const Point2& point) {
    if (point[0] > low_[0] && point[0] < high_[0] && point[1] > low_[1] && point[1] < high_[1]) {
      return;
    }
    if (!inside(point)) keep(point);
  }
  /// Returns convex_hull() of all points added.
  [[nodiscard]] std::vector<Point2> corners() const;

 private:
  [[nodiscard]] bool inside(const Point2& point) const;
  void keep(const Point2& point);

  std::vector<Point2> hull_, waiting_;
  std::size_t upper_ = 0;  ///< the index of the greatest corner in x, then y
  Point2 low_{}, high_{};  ///< a box inside the hull; empty if low == high
};

}  // namespace terrace::terrain
