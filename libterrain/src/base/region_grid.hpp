// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// How often the edges of polygons go from side to side of the box from `low` to `high`, along each
/// axis, all taken together.
Point2 reach_of(const std::vector<Polygon>& polygons, const Point2& low, const Point2& high);

/// Cells over polygons, each inside, outside, or crossed by a ring: classifies most places and
/// boxes in constant time. May be used by several threads at once.
class RegionGrid {
 public:
  /// About ten cells per corner, from 256 x 256 to 1024 x 1024 with 5 bytes each; fewer where edges
  /// cross many cells, so that the time is linear in the corners. The polygons must
  /// have finite corners. inside: called for places that lie on no ring.
  RegionGrid(const std::vector<Polygon>& polygons,
             const std::function<bool(const Point2&)>& inside);

  /// Classifies a place or a box. `none` and `whole` are certain, `whole` excludes touching a ring;
  /// `part` is undecided. A place must lie within the polygons' bounds.
  [[nodiscard]] Overlap overlap(const Point2& place) const {
    return static_cast<Overlap>(cells_[cell(1, place[1]) * side_ + cell(0, place[0])]);
  }
  [[nodiscard]] Overlap overlap(const Point2& low, const Point2& high) const;

 private:
  /// Monotone in `place`, so a place between two others lies between their cells.
  [[nodiscard]] std::size_t cell(std::size_t axis, double value) const {
    const double place = (value - low_[axis]) * per_unit_[axis];
    // `!(place > 0)` also takes NaN, which an extent near the smallest double can give.
    if (!(place > 0)) return 0;
    return place < static_cast<double>(side_) ? static_cast<std::size_t>(place) : side_ - 1;
  }
  void mark_edge(const Point2& a, const Point2& b);
  void classify(const std::function<bool(const Point2&)>& inside);

  std::size_t side_ = 256;
  Point2 low_{}, high_{}, per_unit_{}, margin_{};
  std::vector<std::uint8_t> cells_;  ///< an Overlap each, small enough for the caches
  /// Summed-area table of those numbers: four of its entries give the sum of any rectangle.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
