// SPDX-License-Identifier: Apache-2.0
#include "raster/order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace terrace::stream {
namespace {

constexpr std::uint64_t kTilesPerSide = 16;

std::uint64_t parts_of(std::uint64_t total, std::uint64_t part) {
  return (total + part - 1) / part;
}

int sign(int x) { return (x > 0) - (x < 0); }

/// Returns half of x, rounded down (also if negative).
int half(int x) { return x >= 0 ? x / 2 : -((1 - x) / 2); }

struct Step {
  int x, y;
};

/// Builds the curve of hilbert_order() recursively.
class Hilbert {
 public:
  Hilbert(std::uint32_t columns, std::uint32_t rows) : columns_(columns) {
    order_.reserve(std::size_t{columns} * rows);
    const int w = static_cast<int>(columns), h = static_cast<int>(rows);
    if (w >= h) {
      walk({0, 0}, {w, 0}, {0, h});
    } else {
      walk({0, 0}, {0, h}, {w, 0});
    }
  }
  std::vector<std::uint32_t> take() { return std::move(order_); }

 private:
  /// Fills the rectangle at `at` spanned by the major axis a and the minor axis b.
  void walk(Step at, Step a, Step b) {
    const int w = std::abs(a.x + a.y), h = std::abs(b.x + b.y);
    const Step da{sign(a.x), sign(a.y)}, db{sign(b.x), sign(b.y)};
    if (h == 1 || w == 1) {
      const Step d = h == 1 ? da : db;
      for (int i = 0; i < std::max(w, h); ++i, at.x += d.x, at.y += d.y) visit(at);
      return;
    }
    Step a2{half(a.x), half(a.y)}, b2{half(b.x), half(b.y)};
    if (2 * w > 3 * h) {  // if long, two halves, one after the other
      if (std::abs(a2.x + a2.y) % 2 != 0 && w > 2) a2 = {a2.x + da.x, a2.y + da.y};
      walk(at, a2, b);
      walk({at.x + a2.x, at.y + a2.y}, {a.x - a2.x, a.y - a2.y}, b);
      return;
    }
    if (std::abs(b2.x + b2.y) % 2 != 0 && h > 2) b2 = {b2.x + db.x, b2.y + db.y};
    walk(at, b2, a2);  // up, across, down
    walk({at.x + b2.x, at.y + b2.y}, a, {b.x - b2.x, b.y - b2.y});
    walk({at.x + (a.x - da.x) + (b2.x - db.x), at.y + (a.y - da.y) + (b2.y - db.y)}, {-b2.x, -b2.y},
         {-(a.x - a2.x), -(a.y - a2.y)});
  }

  void visit(Step at) {
    order_.push_back(static_cast<std::uint32_t>(at.y) * columns_ +
                     static_cast<std::uint32_t>(at.x));
  }

  std::uint32_t columns_;
  std::vector<std::uint32_t> order_;
};

/// Returns `length` rounded up to complete blocks, but at most `total`.
std::uint64_t in_blocks(std::uint64_t length, std::uint64_t block, std::uint64_t total) {
  return std::min(parts_of(std::min(length, total), block) * block, total);
}

/// Returns the length of parts of `total` that are as even as blocks allow, and at most `length`
/// (complete blocks, or `total`).
std::uint64_t even_length(std::uint64_t length, std::uint64_t block, std::uint64_t total) {
  return in_blocks(parts_of(total, parts_of(total, length)), block, total);
}

}  // namespace

GridSize ground_square(std::uint64_t cells, double aspect) {
  const double side = std::sqrt(static_cast<double>(cells) * aspect);
  const double max_side = static_cast<double>(cells);
  const auto columns = static_cast<std::uint64_t>(std::clamp(side, 1.0, max_side));
  return {columns, std::max<std::uint64_t>(cells / columns, 1)};
}

GridSize tiles_of(GridSize window, std::uint64_t cells, double aspect) {
  const GridSize tile = ground_square(cells, aspect);
  // Even division makes tiles smaller than the limit in one direction, so they may be larger in the
  // other.
  if (window.columns * tile.rows < window.rows * tile.columns) {
    const std::uint64_t across = parts_of(window.columns, tile.columns);
    const std::uint64_t rows = std::max<std::uint64_t>(cells / parts_of(window.columns, across), 1);
    return {across, parts_of(window.rows, rows)};
  }
  const std::uint64_t down = parts_of(window.rows, tile.rows);
  const std::uint64_t columns = std::max<std::uint64_t>(cells / parts_of(window.rows, down), 1);
  return {parts_of(window.columns, columns), down};
}

std::vector<std::uint32_t> hilbert_order(std::uint32_t columns, std::uint32_t rows) {
  return Hilbert(columns, rows).take();
}

GridSize window_size(const RasterInfo& info, std::uint64_t cells, std::uint64_t tile_cells,
                     double aspect) {
  const GridSize tile = ground_square(tile_cells, aspect);
  const std::uint64_t min_columns =
      in_blocks(kTilesPerSide * tile.columns, info.block_columns, info.columns);
  const std::uint64_t min_rows = in_blocks(kTilesPerSide * tile.rows, info.block_rows, info.rows);
  // As wide as memory allows, in complete blocks.
  if (const std::uint64_t max_columns = cells / min_rows; max_columns >= min_columns) {
    const std::uint64_t columns = max_columns >= info.columns
                                      ? info.columns
                                      : max_columns / info.block_columns * info.block_columns;
    return {even_length(columns, info.block_columns, info.columns),
            even_length(min_rows, info.block_rows, info.rows)};
  }
  // Even with the minimum width, memory is too small for the minimum number of rows.
  const std::uint64_t columns = std::min(min_columns, std::max<std::uint64_t>(cells, 1));
  const std::uint64_t max_rows = std::max<std::uint64_t>(cells / columns, 1);
  if (max_rows < info.block_rows) return {columns, max_rows};
  return {columns,
          even_length(max_rows / info.block_rows * info.block_rows, info.block_rows, info.rows)};
}

}  // namespace terrace::stream
