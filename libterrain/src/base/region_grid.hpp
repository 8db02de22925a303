// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Returns the total length of the polygons' edges along each axis, in multiples of the side of the
/// box from `low` to `high`.
Point2 edge_extent(const std::vector<Polygon>& polygons, const Point2& low, const Point2& high);

/// A grid over polygons with cells that are inside, outside, or crossed by a ring. Classifies most
/// places and boxes in constant time. Several threads may use it at once.
class RegionGrid {
 public:
  /// Uses about ten cells per corner, from 256 x 256 to 1024 x 1024 with 5 bytes each; fewer where
  /// edges cross many cells, so that the time is linear in the corners. The polygons must have
  /// finite corners. inside: called for places that are not on a ring.
  RegionGrid(const std::vector<Polygon>& polygons,
             const std::function<bool(const Point2&)>& inside);

  /// Classifies a place or a box. `none` and `whole` are certain, and `whole` excludes touching a
  /// ring; `part` is undecided. A place must be within the polygons' bounds.
  [[nodiscard]] Overlap overlap(const Point2& place) const {
    return static_cast<Overlap>(cells_[cell(1, place[1]) * side_ + cell(0, place[0])]);
  }
  [[nodiscard]] Overlap overlap(const Point2& low, const Point2& high) const;

 private:
  /// Monotone in `value`, so the cell of a value between two others is between their cells.
  [[nodiscard]] std::size_t cell(std::size_t axis, double value) const {
    const double place = (value - low_[axis]) * per_unit_[axis];
    // `!(place > 0)` is also true for NaN, which an extent near the smallest double can produce.
    if (!(place > 0)) return 0;
    return place < static_cast<double>(side_) ? static_cast<std::size_t>(place) : side_ - 1;
  }
  void mark_edge(const Point2& a, const Point2& b);
  void classify(const std::function<bool(const Point2&)>& inside);

  std::size_t side_ = 256;
  Point2 low_{}, high_{}, per_unit_{}, margin_{};
  std::vector<std::uint8_t> cells_;  ///< one Overlap per cell, small enough for the caches
  /// Summed-area table of these numbers: four of its entries give the sum over any rectangle.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
