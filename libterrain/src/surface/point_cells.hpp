// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "base/large_array.hpp"
#include "surface/circle_cover.hpp"
#include "surface/store_window.hpp"
#include "surface/wanted_clusters.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The points in a box of a store, sorted into the cells of a grid. Of points with the same x and
/// y, keeps the first of StoreWindow::points().
class PointCells {
 public:
  /// Peak memory in bytes per point.
  static constexpr std::uint64_t kBytesPerPoint = 58;

  /// Loads the points of wanted clusters in the box, replacing the contents. Returns false, with
  /// no contents, if there are more than max_points, or if they are crowded into few cells and
  /// `allow_crowding` is not set. Takes about 60 ns per point. Throws: stream::Error on a damaged
  /// store, stream::Stopped.
  bool load(stream::StoreQuery& query, const WantedClusters& wanted, const StoredBox& box,
            std::size_t max_points, bool allow_crowding);
  /// Loads all points of a level and above with several threads. Each thread decodes consecutive
  /// clusters, then sorts a band of rows. Returns false if the points are crowded, but keeps them.
  /// Throws: as above.
  bool load_all(const stream::Store& store, unsigned level, unsigned threads);
  void clear();

  /// Whether all points at a position are loaded.
  [[nodiscard]] bool covers(const Point2& position) const { return loaded_box_.contains(position); }
  /// Whether all points in a box are loaded.
  [[nodiscard]] bool covers(const StoredBox& box) const { return loaded_box_.covers(box); }
  /// Returns the height of a loaded point, in the store's vertical unit.
  [[nodiscard]] double height(const Point2& point) const;
  /// The points, sorted by cell, and their heights.
  [[nodiscard]] std::span<const Point2> positions() const {
    return {positions_.get(), cell_begin_.back()};
  }
  [[nodiscard]] std::span<const double> heights() const {
    return {heights_.get(), cell_begin_.back()};
  }

  /// A rectangle of cells of the grid.
  struct Range {
    std::uint32_t column = 0, row = 0, end_column = 0, end_row = 0;
    [[nodiscard]] std::size_t count() const {
      return std::size_t{end_column - column} * (end_row - row);
    }
    [[nodiscard]] bool contains(const Range& other) const {
      return other.column >= column && other.row >= row && other.end_column <= end_column &&
             other.end_row <= end_row;
    }
  };
  /// Returns the cells that contain all points in a box (index() is monotonic).
  [[nodiscard]] Range cells_of(const StoredBox& box) const {
    return {index(0, box.min[0], columns_), index(1, box.min[1], rows_),
            index(0, box.max[0], columns_) + 1, index(1, box.max[1], rows_) + 1};
  }
  /// Returns the cell of a position and all cells up to `radius` columns and rows away.
  [[nodiscard]] Range neighbourhood(const Point2& position, std::uint32_t radius) const {
    const Range centre = cells_of({position, position});
    return {
        centre.column - std::min(centre.column, radius), centre.row - std::min(centre.row, radius),
        std::min(centre.end_column + radius, columns_), std::min(centre.end_row + radius, rows_)};
  }
  /// Whether a box covers few more cells than a neighbourhood of this radius, or any such
  /// neighbourhood has all cells.
  [[nodiscard]] bool is_small_or_all(const StoredBox& box, std::uint32_t radius) const {
    const std::size_t side = 2 * std::size_t{radius} + 1;
    return cells_of(box).count() <= 2 * side * side || (radius >= columns_ && radius >= rows_);
  }
  /// Calls visit(i) for each positions()[i] in these cells.
  template <class Visit>
  void visit_indices(const Range& range, const Visit& visit) const {
    for (std::uint32_t row = range.row; row < range.end_row; ++row) {
      const std::size_t first = std::size_t{row} * columns_;
      const std::uint32_t end = cell_begin_[first + range.end_column];
      for (std::uint32_t i = cell_begin_[first + range.column]; i < end; ++i) visit(i);
    }
  }
  /// Calls visit(point) for each point in these cells.
  template <class Visit>
  void visit_points(const Range& range, const Visit& visit) const {
    visit_indices(range, [&](std::uint32_t i) { visit(positions_[i]); });
  }
  /// Calls visit(point) for each point in these cells, except for cells in `excluded`.
  template <class Visit>
  void visit_points(const Range& range, const Range& excluded, const Visit& visit) const {
    for (std::uint32_t row = range.row; row < range.end_row; ++row) {
      const auto visit_part = [&](std::uint32_t column, std::uint32_t end_column) {
        if (column < end_column) visit_points({column, row, end_column, row + 1}, visit);
      };
      if (row < excluded.row || row >= excluded.end_row) {
        visit_part(range.column, range.end_column);
      } else {
        visit_part(range.column, std::min(range.end_column, excluded.column));
        visit_part(std::max(range.column, excluded.end_column), range.end_column);
      }
    }
  }
  /// Calls visit(point) for all points in the cover and for some others, roughly by distance from
  /// `near`. The visitor may shrink the cover. Skips empty cells quickly.
  template <class Visit>
  void visit_cover(const CircleCover& cover, const Point2& near, const Visit& visit) const {
    const Range range = cells_of(cover.bounds());
    constexpr std::size_t kMaxUntestedCells = 36;
    if (range.count() <= kMaxUntestedCells) {
      visit_points(range, visit);
    } else {
      visit_halves(range, cover, cells_of({near, near}), visit);
    }
  }
  /// The width and height of a cell.
  [[nodiscard]] std::array<double, 2> cell_size() const { return cell_size_; }

 private:
  [[nodiscard]] std::uint32_t index(std::size_t axis, double stored, std::uint32_t count) const {
    const double cells = (stored - box_.min[axis]) * cells_per_unit_[axis];
    // `!(cells > 0)` is also true for NaN.
    if (!(cells > 0)) return 0;
    return cells < count ? static_cast<std::uint32_t>(cells) : count - 1;
  }
  [[nodiscard]] std::size_t cell(const Point2& position) const {
    return std::size_t{index(1, position[1], rows_)} * columns_ + index(0, position[0], columns_);
  }
  /// Returns a box that contains the points in a range of cells.
  [[nodiscard]] StoredBox box_of(const Range& range) const;
  /// Sorts points of the box, in the order of StoreWindow::points(), into the cells. Returns false
  /// if they are crowded. Keeps crowded points only if `allow_crowding` is set.
  bool sort(const stream::Store& store, const StoredBox& box, std::span<const Point2> positions,
            std::span<const double> heights, bool allow_crowding, unsigned threads);
  void drop_duplicates();

  /// Whether a range of cells contains a point.
  [[nodiscard]] bool has_points(const Range& range) const {
    const std::size_t side = std::size_t{columns_} + 1;
    const auto sum = [&](std::uint32_t column, std::uint32_t row) {
      return prefix_sums_[row * side + column];
    };
    return sum(range.end_column, range.end_row) - sum(range.column, range.end_row) -
               sum(range.end_column, range.row) + sum(range.column, range.row) !=
           0;
  }
  /// Visits the points of a range that overlaps the cover, the half closer to the cell `near`
  /// first.
  template <class Visit>
  void visit_halves(const Range& range, const CircleCover& cover, const Range& near,
                    const Visit& visit) const {
    if (!has_points(range) || !cover.meets(box_of(range))) return;
    constexpr std::size_t kLeafCells = 4;
    if (range.count() <= kLeafCells) return visit_points(range, visit);
    Range first = range, second = range;
    bool is_first_closer;
    if (range.end_column - range.column >= range.end_row - range.row) {
      first.end_column = second.column = range.column + (range.end_column - range.column) / 2;
      is_first_closer = near.column < second.column;
    } else {
      first.end_row = second.row = range.row + (range.end_row - range.row) / 2;
      is_first_closer = near.row < second.row;
    }
    if (!is_first_closer) std::swap(first, second);
    visit_halves(first, cover, near, visit);
    visit_halves(second, cover, near, visit);
  }

  StoredBox box_{};
  /// The box whose points are all loaded. It is infinite where the store has no further points.
  StoredBox loaded_box_{};
  std::array<double, 2> cells_per_unit_{}, cell_size_{};
  std::uint32_t columns_ = 1, rows_ = 1;
  LargeArray<Point2> positions_;  ///< by cell, row by row
  LargeArray<double> heights_;    ///< heights of positions_
  /// Index in positions_ of the first point of each cell, then the number of points.
  std::vector<std::uint32_t> cell_begin_;
  /// Number of points in the cells left of and above each corner of the grid, row by row.
  std::vector<std::uint32_t> prefix_sums_;
};

}  // namespace terrace::terrain
