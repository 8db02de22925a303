// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "raster/order.hpp"

namespace terrace::stream {
namespace {

TEST(RasterOrder, HilbertVisitsEveryFieldOnceByNeighbours) {
  for (std::uint32_t columns = 1; columns <= 24; ++columns) {
    for (std::uint32_t rows = 1; rows <= 24; ++rows) {
      SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows));
      const auto order = hilbert_order(columns, rows);
      auto sorted = order;
      std::sort(sorted.begin(), sorted.end());
      ASSERT_EQ(sorted.size(), std::size_t{columns} * rows);
      for (std::size_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
      ASSERT_EQ(order.front(), 0u);
      for (std::size_t i = 1; i < order.size(); ++i) {
        const auto dx = std::abs(static_cast<int>(order[i] % columns) -
                                 static_cast<int>(order[i - 1] % columns));
        const auto dy = std::abs(static_cast<int>(order[i] / columns) -
                                 static_cast<int>(order[i - 1] / columns));
        ASSERT_LE(std::max(dx, dy), 1);
      }
    }
  }
}

TEST(RasterOrder, TilesAreNearlySquareAndFull) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20000; ++i) {
    const GridSize window{1 + random() % (1u << (1 + random() % 20)),
                          1 + random() % (1u << (1 + random() % 20))};
    const std::uint64_t cells = 1 + random() % (1u << (1 + random() % 16));
    const double aspect = static_cast<double>(1 + random() % 64) / 16.0;
    SCOPED_TRACE(std::to_string(window.columns) + " x " + std::to_string(window.rows) + ", " +
                 std::to_string(cells) + " cells, aspect " + std::to_string(aspect));
    const GridSize tiles = tiles_of(window, cells, aspect);
    ASSERT_GE(tiles.columns, 1u);
    ASSERT_GE(tiles.rows, 1u);
    ASSERT_LE(tiles.columns, window.columns);
    ASSERT_LE(tiles.rows, window.rows);
    const std::uint64_t width = (window.columns + tiles.columns - 1) / tiles.columns;
    const std::uint64_t height = (window.rows + tiles.rows - 1) / tiles.rows;
    ASSERT_LE(width * height, cells);
    // In a window of several tiles in each direction, tiles are nearly square and nearly full.
    if (tiles.columns > 8 && tiles.rows > 8 && cells >= 4096) {
      const double shape = static_cast<double>(width) / (static_cast<double>(height) * aspect);
      EXPECT_GT(shape, 0.7);
      EXPECT_LT(shape, 1.4);
      EXPECT_GT(static_cast<double>(width * height), 0.75 * static_cast<double>(cells));
    }
  }
}

TEST(RasterOrder, WindowsFitMemoryAndHaveCompleteBlocksIfPossible) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 20000; ++i) {
    RasterInfo info;
    info.columns = 1 + random() % (1u << (1 + random() % 29));
    info.rows = 1 + random() % (1u << (1 + random() % 29));
    info.block_columns = std::min<std::uint64_t>(1 + random() % 1024, info.columns);
    info.block_rows = std::min<std::uint64_t>(1 + random() % 1024, info.rows);
    if (random() % 2 == 0) info.block_columns = info.columns;
    const std::uint64_t cells = 1 + random() % (1u << 25);
    const std::uint64_t tile_cells = 1 + random() % 20000;
    SCOPED_TRACE(std::to_string(info.columns) + " x " + std::to_string(info.rows) + ", blocks " +
                 std::to_string(info.block_columns) + " x " + std::to_string(info.block_rows) +
                 ", " + std::to_string(cells) + " cells, tiles of " + std::to_string(tile_cells));
    const GridSize window = window_size(info, cells, tile_cells, 1.0);
    ASSERT_GE(window.columns, 1u);
    ASSERT_GE(window.rows, 1u);
    ASSERT_LE(window.columns, info.columns);
    ASSERT_LE(window.rows, info.rows);
    ASSERT_LE(window.columns * window.rows, std::max<std::uint64_t>(cells, 1));
    if (info.block_columns * info.block_rows <= cells / 512 && cells / 512 >= tile_cells) {
      ASSERT_TRUE(window.columns % info.block_columns == 0 || window.columns == info.columns);
      ASSERT_TRUE(window.rows % info.block_rows == 0 || window.rows == info.rows);
    }
    // Strips are not cut if a row of one fits.
    if (info.block_columns == info.columns && info.columns <= cells) {
      ASSERT_EQ(window.columns, info.columns);
    }
  }
}

}  // namespace
}  // namespace terrace::stream
