// SPDX-License-Identifier: GPL-3.0-or-later
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
  /// About ten cells per corner, from 256 x 256 to 1024 x 1024 with 4 bytes each. The polygons must
  /// have finite corners. inside: asked of places that are on no ring.
  RegionGrid(const std::vector<Polygon>& polygons,
             const std::function<bool(const Point2&)>& inside);

  /// How a box, or a place as a box without size, lies to the polygons. `none` and `whole` are
  /// certain, `whole` means not even touching a ring; `part`: not known here.
  [[nodiscard]] Overlap overlap(const Point2& low, const Point2& high) const;

 private:
  /// What a cell adds to the sums.
  static constexpr std::uint32_t kOutside = 0, kRing = 1, kInside = 2;

  [[nodiscard]] std::size_t cell(std::size_t axis, double value) const;
  void mark_edge(const Point2& a, const Point2& b);
  void classify(const std::function<bool(const Point2&)>& inside);
  std::uint32_t& at(std::size_t column, std::size_t row) {
    return sums_[(row + 1) * (side_ + 1) + column + 1];
  }

  std::size_t side_ = 256;
  Point2 low_{}, high_{}, per_unit_{}, margin_{};
  /// Over all cells with a lower column and row, so that any rectangle of cells is told from four.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
