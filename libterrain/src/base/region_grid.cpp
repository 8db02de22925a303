// SPDX-License-Identifier: Apache-2.0
#include "base/region_grid.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::terrain {
namespace {

constexpr std::size_t kMinGridSide = 16, kMaxGridSide = 1024, kCellsPerCorner = 10;
/// Limit on the cells to mark. A cell counts once for each edge that marks it.
constexpr double kMaxMarks = 0x1p25;
constexpr auto kOutside = static_cast<std::uint8_t>(Overlap::none);
constexpr auto kRing = static_cast<std::uint8_t>(Overlap::part);
constexpr auto kInside = static_cast<std::uint8_t>(Overlap::whole);
static_assert(kOutside == 0 && kRing == 1 && kInside == 2, "sums over cells rely on these values");

}  // namespace

Point2 edge_extent(const std::vector<Polygon>& polygons, const Point2& low, const Point2& high) {
  Point2 extent{};
  for (const Polygon& polygon : polygons) {
    for (const std::vector<Point2>& ring : polygon) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Point2& next = ring[i + 1 == ring.size() ? 0 : i + 1];
        for (std::size_t axis = 0; axis < 2; ++axis) {
          if (!(high[axis] > low[axis])) continue;
          extent[axis] +=
              std::abs(next[axis] / 2 - ring[i][axis] / 2) / (high[axis] / 2 - low[axis] / 2);
        }
      }
    }
  }
  return extent;
}

RegionGrid::RegionGrid(const std::vector<Polygon>& polygons,
                       const std::function<bool(const Point2&)>& inside)
    : low_(polygons.front().front().front()), high_(low_) {
  std::size_t corners = 0;
  for (const Polygon& polygon : polygons) {
    for (const std::vector<Point2>& ring : polygon) {
      corners += ring.size();
      for (const Point2& p : ring) {
        for (std::size_t axis = 0; axis < 2; ++axis) {
          low_[axis] = std::min(low_[axis], p[axis]);
          high_[axis] = std::max(high_[axis], p[axis]);
        }
      }
    }
  }
  while (side_ < kMaxGridSide && side_ * side_ < kCellsPerCorner * corners) side_ *= 2;
  // Many edges across the whole box would mark the same cells again and again, so use larger cells.
  const Point2 extent = edge_extent(polygons, low_, high_);
  while (side_ > kMinGridSide && (extent[0] + extent[1]) * static_cast<double>(side_) > kMaxMarks) {
    side_ /= 2;
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    per_unit_[axis] = static_cast<double>(side_) / (high_[axis] - low_[axis]);
    // More than the rounding error of interpolated points on an edge.
    margin_[axis] = std::max(std::abs(low_[axis]), std::abs(high_[axis])) * 0x1p-48;
  }
  cells_.assign(side_ * side_, kOutside);
  for (const Polygon& polygon : polygons) {
    for (const std::vector<Point2>& ring : polygon) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        mark_edge(ring[i], ring[i + 1 == ring.size() ? 0 : i + 1]);
      }
    }
  }
  classify(inside);
  sums_.assign((side_ + 1) * (side_ + 1), 0);
  for (std::size_t row = 0; row < side_; ++row) {
    const std::size_t above = row * (side_ + 1), current = above + side_ + 1;
    std::uint32_t sum = 0;
    for (std::size_t column = 0; column < side_; ++column) {
      sum += cells_[row * side_ + column];
      sums_[current + column + 1] = sum + sums_[above + column + 1];
    }
  }
}

void RegionGrid::mark_edge(const Point2& a, const Point2& b) {
  std::size_t pieces = 1;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::size_t from = cell(axis, a[axis]), to = cell(axis, b[axis]);
    pieces = std::max(pieces, from < to ? to - from : from - to);
  }
  Point2 start = a;
  for (std::size_t i = 1; i <= pieces; ++i) {
    Point2 end = b;
    std::size_t first[2], last[2];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (i < pieces) {
        end[axis] =
            a[axis] + (b[axis] - a[axis]) * (static_cast<double>(i) / static_cast<double>(pieces));
      }
      first[axis] = cell(axis, std::min(start[axis], end[axis]) - margin_[axis]);
      last[axis] = cell(axis, std::max(start[axis], end[axis]) + margin_[axis]);
    }
    for (std::size_t row = first[1]; row <= last[1]; ++row) {
      for (std::size_t column = first[0]; column <= last[0]; ++column)
        cells_[row * side_ + column] = kRing;
    }
    start = end;
  }
}

/// Neighbouring cells of a row without a crossed cell between them are on the same side, so one
/// test decides for all of them.
void RegionGrid::classify(const std::function<bool(const Point2&)>& inside) {
  for (std::size_t row = 0; row < side_; ++row) {
    const double y = low_[1] + (static_cast<double>(row) + 0.5) / per_unit_[1];
    std::uint8_t side = kRing;
    for (std::size_t column = 0; column < side_; ++column) {
      std::uint8_t& value = cells_[row * side_ + column];
      if (value == kRing) {
        side = kRing;
        continue;
      }
      if (side == kRing) {
        const double x = low_[0] + (static_cast<double>(column) + 0.5) / per_unit_[0];
        // Where cells are narrower than the spacing of doubles, a centre may be in another cell.
        if (cell(0, x) == column && cell(1, y) == row) side = inside({x, y}) ? kInside : kOutside;
      }
      value = side;
    }
  }
}

Overlap RegionGrid::overlap(const Point2& low, const Point2& high) const {
  const std::size_t left = cell(0, low[0]), right = cell(0, high[0]) + 1;
  const std::size_t top = cell(1, low[1]) * (side_ + 1),
                    bottom = (cell(1, high[1]) + 1) * (side_ + 1);
  const std::uint32_t sum =
      sums_[bottom + right] - sums_[bottom + left] - sums_[top + right] + sums_[top + left];
  if (sum == kOutside) return Overlap::none;
  const bool outside =
      low[0] < low_[0] || low[1] < low_[1] || high[0] > high_[0] || high[1] > high_[1];
  const std::size_t cells = (right - left) * ((bottom - top) / (side_ + 1));
  return sum == kInside * cells && !outside ? Overlap::whole : Overlap::part;
}

}  // namespace terrace::terrain
