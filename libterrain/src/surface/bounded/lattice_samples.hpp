// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/tri/grid_tin.hpp>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// The samples of a window of a raster and of the lines around it, as far as the raster extends.
/// NaN: no data.
template <class T>
struct LatticeSamples {
  std::int64_t columns = 0, rows = 0;  ///< size of the window
  std::vector<T> heights;              ///< heights of the window
  // The lines just outside; empty at the raster's borders.
  std::vector<T> above, below, left, right;

  /// Reads a window. Before a sample is used, change(column, row, height) may change its height;
  /// column and row are relative to the window, so those around it are -1 or its size. Throws:
  /// as StoreWindow.
  template <class Change>
  static LatticeSamples read(StoreWindow& reader, const LatticeWindow& window,
                             const Change& change) {
    const stream::StoreSchema& schema = reader.query().store().schema();
    const LatticeWindow wide{window.column - 1, window.row - 1, window.columns + 2,
                             window.rows + 2};
    std::vector<T> heights(wide.size());
    reader.heights(wide, std::span<T>(heights));
    const bool has_left = window.column > 0, has_above = window.row > 0;
    const bool has_right =
        window.column + window.columns < static_cast<std::int64_t>(schema.columns);
    const bool has_below = window.row + window.rows < static_cast<std::int64_t>(schema.rows);
    LatticeSamples samples;
    samples.columns = window.columns;
    samples.rows = window.rows;
    for (std::int64_t r = -1; r <= window.rows; ++r) {
      if ((r < 0 && !has_above) || (r == window.rows && !has_below)) continue;
      for (std::int64_t c = -1; c <= window.columns; ++c) {
        if ((c < 0 && !has_left) || (c == window.columns && !has_right)) continue;
        change(c, r, heights[static_cast<std::size_t>((r + 1) * wide.columns + c + 1)]);
      }
    }
    const auto line = [&](std::int64_t c, std::int64_t r, std::int64_t count, std::int64_t step) {
      std::vector<T> out;
      auto at = static_cast<std::size_t>((r + 1) * wide.columns + c + 1);
      for (std::int64_t i = 0; i < count; ++i, at += static_cast<std::size_t>(step)) {
        out.push_back(heights[at]);
      }
      return out;
    };
    if (has_above) samples.above = line(0, -1, window.columns, 1);
    if (has_below) samples.below = line(0, window.rows, window.columns, 1);
    if (has_left) samples.left = line(-1, 0, window.rows, wide.columns);
    if (has_right) samples.right = line(window.columns, 0, window.rows, wide.columns);
    samples.heights.reserve(window.size());
    for (std::int64_t r = 0; r < window.rows; ++r) {
      const auto first = heights.begin() + static_cast<std::ptrdiff_t>((r + 1) * wide.columns + 1);
      samples.heights.insert(samples.heights.end(), first,
                             first + static_cast<std::ptrdiff_t>(window.columns));
    }
    return samples;
  }

  [[nodiscard]] tri::GridWindow<T> grid() const {
    return {static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows), heights};
  }

  /// Returns the vertices on the sides for a bound. Those on a side depend only on the samples on
  /// it and next to it, so two windows that share it have the same vertices there.
  [[nodiscard]] tri::GridSides sides(double max_error) const {
    const auto settle = [&](const std::vector<T>& line, const std::vector<T>& inside,
                            const std::vector<T>& outside) {
      return tri::settle_side<T>(line, inside, outside, max_error);
    };
    const std::int64_t last_column = columns - 1, last_row = rows - 1;
    const std::vector<T> none;
    return {.first_row = settle(row(0), last_row > 0 ? row(1) : none, above),
            .last_row = settle(row(last_row), last_row > 0 ? row(last_row - 1) : none, below),
            .first_column = settle(column(0), last_column > 0 ? column(1) : none, left),
            .last_column = settle(column(last_column),
                                  last_column > 0 ? column(last_column - 1) : none, right)};
  }

 private:
  [[nodiscard]] std::vector<T> column(std::int64_t c) const {
    std::vector<T> line;
    for (std::int64_t r = 0; r < rows; ++r) {
      line.push_back(heights[static_cast<std::size_t>(r * columns + c)]);
    }
    return line;
  }
  [[nodiscard]] std::vector<T> row(std::int64_t r) const {
    const auto first = heights.begin() + static_cast<std::ptrdiff_t>(r * columns);
    return {first, first + static_cast<std::ptrdiff_t>(columns)};
  }
};

}  // namespace terrace::terrain
