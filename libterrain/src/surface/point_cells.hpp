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

/// The points in a box of a store, sorted into the cells of a grid over it. Of points at one x,y
/// the first in the order of StoreWindow::points() counts.
class PointCells {
 public:
  /// Peak bytes per point.
  static constexpr std::uint64_t kBytesPerPoint = 58;

  /// Replaces what is held by the points of `level` and above in the box. False if there are more
  /// than most_points, or if they crowd in few of the cells and `may_crowd` is not set: nothing is
  /// held then. 60 ns per point. Throws: stream::Error on a damaged store, stream::Stopped.
  bool load(stream::StoreQuery& query, unsigned level, const StoredBox& box,
            std::size_t most_points, bool may_crowd);
  /// The same for all points of a store, by several threads: each decodes clusters that follow each
  /// other, and then sorts a band of rows. False if they crowd; they are held all the same. Throws
  /// as above.
  bool load_all(const stream::Store& store, unsigned level, unsigned threads);
  void clear();

  /// All points in it are held. It reaches to infinity where the store has no points beyond.
  [[nodiscard]] const StoredBox& known() const { return known_; }
  [[nodiscard]] bool knows(const Point2& place) const {
    return known_.contains({place[0], place[1], 0});
  }
  /// Whether all points in a box are held.
  [[nodiscard]] bool knows(const StoredBox& box) const {
    return box.min[0] >= known_.min[0] && box.min[1] >= known_.min[1] &&
           box.max[0] <= known_.max[0] && box.max[1] <= known_.max[1];
  }
  /// The height of a point that is held, in the store's vertical unit.
  [[nodiscard]] double height(const Point2& point) const;
  /// All that are held, by cells, and their heights.
  [[nodiscard]] std::span<const Point2> places() const { return {places_.get(), begin_.back()}; }
  [[nodiscard]] std::span<const double> heights() const { return {heights_.get(), begin_.back()}; }

  /// Cells in a rectangle of the grid.
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
  /// Those with all points in a box, since index() ascends.
  [[nodiscard]] Range cells_of(const StoredBox& box) const {
    return {index(0, box.min[0], columns_), index(1, box.min[1], rows_),
            index(0, box.max[0], columns_) + 1, index(1, box.max[1], rows_) + 1};
  }
  /// The cell of a place and as many around it as `reach` says.
  [[nodiscard]] Range near(const Point2& place, std::uint32_t reach) const {
    const Range at = cells_of({place, place});
    return {at.column - std::min(at.column, reach), at.row - std::min(at.row, reach),
            std::min(at.end_column + reach, columns_), std::min(at.end_row + reach, rows_)};
  }
  /// Whether a box has not many more cells than near(), or that has all.
  [[nodiscard]] bool is_near(const StoredBox& box, std::uint32_t reach) const {
    const std::size_t side = 2 * std::size_t{reach} + 1;
    return cells_of(box).count() <= 2 * side * side || (reach >= columns_ && reach >= rows_);
  }
  /// Calls visit(i) for places()[i] in these cells.
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
  /// The same without those of other cells.
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
  /// Calls visit(point) for all in the cover, which may shrink meanwhile, and some around, roughly
  /// from near to far as seen from a place. Cells without points cost nothing, however many.
  template <class Visit>
  void in(const CircleCover& cover, const Point2& from, const Visit& visit) const {
    const Range range = cells_of(cover.bounds());
    // Few cells are visited without asking.
    constexpr std::size_t kFewCells = 36;
    if (range.count() <= kFewCells) {
      visit_cells(range, visit);
    } else {
      visit_meeting(range, cover, cells_of({from, from}), visit);
    }
  }
  /// The sides of a cell.
  [[nodiscard]] std::array<double, 2> cell_size() const { return cell_size_; }

 private:
  [[nodiscard]] std::uint32_t index(std::size_t axis, double stored, std::uint32_t count) const {
    const double at = (stored - box_.min[axis]) * per_unit_[axis];
    // `!(at > 0)` also takes NaN.
    if (!(at > 0)) return 0;
    return at < count ? static_cast<std::uint32_t>(at) : count - 1;
  }
  [[nodiscard]] std::size_t cell(const Point2& place) const {
    return std::size_t{index(1, place[1], rows_)} * columns_ + index(0, place[0], columns_);
  }
  /// A box that holds the points in a range of cells.
  [[nodiscard]] StoredBox box_of(const Range& range) const;
  /// Takes points of the box in the order of StoreWindow::points(). False: they crowd; then they
  /// are held only if they may.
  bool sort(const stream::Store& store, const StoredBox& box, std::span<const Point2> places,
            std::span<const double> heights, bool may_crowd, unsigned threads);
  void drop_duplicates();

  /// Whether there is a point in a range of cells.
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
  std::vector<std::uint32_t> begin_;  ///< in places_, by cell; at last their number
  /// Points in the cells left of and above each corner of the grid, row by row.
  std::vector<std::uint32_t> sums_;
};

}  // namespace terrace::terrain
