// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Cells over polygons, each known to lie inside, outside, or at a ring: tells of most places and
/// boxes in constant time how they lie to the polygons. Safe to use from several threads.
class RegionGrid {
 public:
  /// About ten cells per corner, from 256 x 256 to 1024 x 1024 with 5 bytes each. The polygons must
  /// have finite corners. inside: asked of places that are on no ring.
  RegionGrid(const std::vector<Polygon>& polygons,
             const std::function<bool(const Point2&)>& inside);

  /// How a place or a box lies to the polygons. `none` and `whole` are certain, `whole` means not
  /// even touching a ring; `part`: not known here. A place must lie within the polygons' bounds.
  [[nodiscard]] Overlap overlap(const Point2& place) const {
    return static_cast<Overlap>(cells_[cell(1, place[1]) * side_ + cell(0, place[0])]);
  }
  [[nodiscard]] Overlap overlap(const Point2& low, const Point2& high) const;

 private:
  /// Never falls where `value` grows, so whatever lies between two places lies between their cells.
  [[nodiscard]] std::size_t cell(std::size_t axis, double value) const {
    const double place = (value - low_[axis]) * per_unit_[axis];
    // `!(place > 0)` also takes NaN, which an extent near the smallest double brings about.
    if (!(place > 0)) return 0;
    return place < static_cast<double>(side_) ? static_cast<std::size_t>(place) : side_ - 1;
  }
  void mark_edge(const Point2& a, const Point2& b);
  void classify(const std::function<bool(const Point2&)>& inside);

  std::size_t side_ = 256;
  Point2 low_{}, high_{}, per_unit_{}, margin_{};
  std::vector<std::uint8_t> cells_;  ///< an Overlap each: so small that caches keep them
  /// Sums of those numbers over all cells with a lower column and row: any rectangle's sum is had
  /// from four of them.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
