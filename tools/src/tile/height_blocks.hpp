// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>

#include "store_window.hpp"

namespace terrace::tools {

/// Lowest and highest samples of the square blocks of a raster, so that what cannot matter need not
/// be read.
class HeightBlocks {
 public:
  /// Reads the store once. Memory: 8 bytes per block, at most 8 MiB. Throws: stream::Error.
  explicit HeightBlocks(const stream::Store& store);

  struct Range {
    double low = 0.0, high = 0.0;  ///< in the vertical unit of the store
  };
  /// Over the blocks that meet the window; nothing if no sample in them has data.
  [[nodiscard]] std::optional<Range> range(const LatticeWindow& window) const;

  /// A block that has data and lies in the window, if there is one: its lattice rectangle.
  [[nodiscard]] std::optional<LatticeWindow> some_block_within(const LatticeWindow& window) const;

 private:
  struct Block {
    float low, high;
  };
  struct Blocks {
    std::int64_t x0, y0, x1, y1;  // half open
  };
  [[nodiscard]] const Block& at(std::int64_t x, std::int64_t y) const {
    return blocks_[static_cast<std::size_t>(y * across_ + x)];
  }

  std::int64_t side_ = 16;  ///< samples
  std::int64_t columns_ = 0, rows_ = 0, across_ = 0, down_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace terrace::tools
