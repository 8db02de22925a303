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
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The points in a box of a store, sorted into the cells of a grid. Of points at one x and y, keeps
/// the first in the order of StoreWindow::points().
class PointCells {
 public:
  /// Peak memory in bytes per point.
  static constexpr std::uint64_t kBytesPerPoint = 58;

  /// Loads the points of `level` and above in the box, replacing the contents. Returns false, with
  /// no contents, if there are more than max_points, or if they are crowded into few cells and
  /// `may_crowd` is not set. 60 ns per point. Throws: stream::Error on a damaged store,
  /// stream::Stopped.
  bool load(stream::StoreQuery& query, unsigned level, const StoredBox& box, std::size_t max_points,
            bool may_crowd);
  /// Loads all points of a store with several threads. Each thread decodes consecutive clusters,
  /// then sorts a band of rows. Returns false if the points are crowded, but keeps them. Throws: as
  /// above.
  bool load_all(const stream::Store& store, unsigned level, unsigned threads);
  void clear();

  /// The box in which all points are known; infinite in directions where the store has no more
  /// points.
  [[nodiscard]] const StoredBox& known() const { return known_; }
  [[nodiscard]] bool knows(const Point2& place) const { return known_.contains(place); }
  /// Whether all points in a box are known.
  [[nodiscard]] bool knows(const StoredBox& box) const { return known_.covers(box); }
  /// Returns the height of a known point, in the store's vertical unit.
  [[nodiscard]] double height(const Point2& point) const;
  /// All points ordered by cells, and their heights.
  [[nodiscard]] std::span<const Point2> places() const { return {places_.get(), begin_.back()}; }
  [[nodiscard]] std::span<const double> heights() const { return {heights_.get(), begin_.back()}; }

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
  /// Returns the cells that contain all points in a box, since index() is ascending.
  [[nodiscard]] Range cells_of(const StoredBox& box) const {
    return {index(0, box.min[0], columns_), index(1, box.min[1], rows_),
            index(0, box.max[0], columns_) + 1, index(1, box.max[1], rows_) + 1};
  }
  /// Returns the cell of a place and the cells up to `reach` around it.
  [[nodiscard]] Range near(const Point2& place, std::uint32_t reach) const {
    const Range at = cells_of({place, place});
    return {at.column - std::min(at.column, reach), at.row - std::min(at.row, reach),
            std::min(at.end_column + reach, columns_), std::min(at.end_row + reach, rows_)};
  }
  /// True if the box covers few more cells than near(), or near() covers them all.
  [[nodiscard]] bool is_near(const StoredBox& box, std::uint32_t reach) const {
    const std::size_t side = 2 * std::size_t{reach} + 1;
    return cells_of(box).count() <= 2 * side * side || (reach >= columns_ && reach >= rows_);
  }
  /// Calls visit(i) for each places()[i] in these cells.
  template <class Visit>
  void visit_indices(const Range& range, const Visit& visit) const {
    for (std::uint32_t row = range.row; row < range.end_row; ++row) {
      const std::size_t first = std::size_t{row} * columns_;
      const std::uint32_t end = begin_[first + range.end_column];
      for (std::uint32_t i = begin_[first + range.column]; i < end; ++i) visit(i);
    }
  }
  template <class Visit>
  void visit_cells(const Range& range, const Visit& visit) const {
    visit_indices(range, [&](std::uint32_t i) { visit(places_[i]); });
  }
  /// As above, except for cells in `without`.
  template <class Visit>
  void visit_cells(const Range& range, const Range& without, const Visit& visit) const {
    for (std::uint32_t row = range.row; row < range.end_row; ++row) {
      const auto visit_part = [&](std::uint32_t column, std::uint32_t end_column) {
        if (column < end_column) visit_cells({column, row, end_column, row + 1}, visit);
      };
      if (row < without.row || row >= without.end_row) {
        visit_part(range.column, range.end_column);
      } else {
        visit_part(range.column, std::min(range.end_column, without.column));
        visit_part(std::max(range.column, without.end_column), range.end_column);
      }
    }
  }
  /// Calls visit(point) for all points in the cover, which may shrink meanwhile, and for some
  /// others, roughly in order of distance from a place. Empty cells cost nothing, however many.
  template <class Visit>
  void in(const CircleCover& cover, const Point2& from, const Visit& visit) const {
    const Range range = cells_of(cover.bounds());
    // Visit a small number of cells without testing them.
    constexpr std::size_t kFewCells = 36;
    if (range.count() <= kFewCells) {
      visit_cells(range, visit);
    } else {
      visit_meeting(range, cover, cells_of({from, from}), visit);
    }
  }
  /// The width and height of a cell.
  [[nodiscard]] std::array<double, 2> cell_size() const { return cell_size_; }

 private:
  [[nodiscard]] std::uint32_t index(std::size_t axis, double stored, std::uint32_t count) const {
    const double at = (stored - box_.min[axis]) * per_unit_[axis];
    // `!(at > 0)` is also true for NaN.
    if (!(at > 0)) return 0;
    return at < count ? static_cast<std::uint32_t>(at) : count - 1;
  }
  [[nodiscard]] std::size_t cell(const Point2& place) const {
    return std::size_t{index(1, place[1], rows_)} * columns_ + index(0, place[0], columns_);
  }
  /// Returns a box around the points in a range of cells.
  [[nodiscard]] StoredBox box_of(const Range& range) const;
  /// Sorts points of the box, given in the order of StoreWindow::points(). Returns false if they
  /// are crowded; then they are kept only if `may_crowd` is set.
  bool sort(const stream::Store& store, const StoredBox& box, std::span<const Point2> places,
            std::span<const double> heights, bool may_crowd, unsigned threads);
  void drop_duplicates();

  /// Whether a range of cells contains a point.
  [[nodiscard]] bool has_points(const Range& range) const {
    const std::size_t side = std::size_t{columns_} + 1;
    const auto sum = [&](std::uint32_t column, std::uint32_t row) {
      return sums_[row * side + column];
    };
    return sum(range.end_column, range.end_row) - sum(range.column, range.end_row) -
               sum(range.end_column, range.row) + sum(range.column, range.row) !=
           0;
  }
  template <class Visit>
  void visit_meeting(const Range& range, const CircleCover& cover, const Range& from,
                     const Visit& visit) const {
    if (!has_points(range) || !cover.meets(box_of(range))) return;
    constexpr std::size_t kFewCells = 4;
    if (range.count() <= kFewCells) return visit_cells(range, visit);
    Range near = range, far = range;
    bool is_first_near;
    if (range.end_column - range.column >= range.end_row - range.row) {
      near.end_column = far.column = range.column + (range.end_column - range.column) / 2;
      is_first_near = from.column < far.column;
    } else {
      near.end_row = far.row = range.row + (range.end_row - range.row) / 2;
      is_first_near = from.row < far.row;
    }
    if (!is_first_near) std::swap(near, far);
    visit_meeting(near, cover, from, visit);
    visit_meeting(far, cover, from, visit);
  }

  StoredBox box_{}, known_{};
  std::array<double, 2> per_unit_{}, cell_size_{};
  std::uint32_t columns_ = 1, rows_ = 1;
  LargeArray<Point2> places_;         ///< by cells, row by row
  LargeArray<double> heights_;        ///< of places_
  std::vector<std::uint32_t> begin_;  ///< indices in places_ by cell; last, the number of places
  /// Number of points in the cells left of and above each corner of the grid, row by row.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
