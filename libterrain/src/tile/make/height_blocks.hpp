// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// The lowest and highest samples of square blocks of a raster, and a hash of each block. The
/// former save reading irrelevant parts. The latter show which tiles are unchanged.
class HeightBlocks {
 public:
  /// Reads the store once, with all threads. Memory: 20 bytes per block, at most 20 MiB. Throws:
  /// stream::Error.
  HeightBlocks(const stream::Store& store, unsigned threads);

  struct Range {
    double low = 0.0, high = 0.0;  ///< in the vertical unit of the store
  };
  /// The range over the blocks that meet the window; nullopt if no sample in them has data.
  [[nodiscard]] std::optional<Range> range(const LatticeWindow& window) const;

  /// Returns the lattice rectangle of a block with data inside the window, if there is one.
  [[nodiscard]] std::optional<LatticeWindow> some_block_within(const LatticeWindow& window) const;

  /// A hash of the samples and their places in all blocks that meet the window. It does not depend
  /// on how the store clusters them.
  [[nodiscard]] std::uint64_t digest(const LatticeWindow& window) const;

  /// Whether every block that meets the window has all its samples.
  [[nodiscard]] bool is_complete(const LatticeWindow& window) const;
  /// Calls visit(lattice rectangle) for each block that meets the window and lacks a sample.
  template <class Visit>
  void for_each_incomplete(const LatticeWindow& window, const Visit& visit) const {
    const Blocks part = blocks_of(window);
    for (std::int64_t y = part.y0; y < part.y1; ++y) {
      for (std::int64_t x = part.x0; x < part.x1; ++x) {
        if (!is_complete(x, y)) visit(rectangle(x, y));
      }
    }
  }

 private:
  struct Block {
    float low, high;
  };
  struct Blocks {
    std::int64_t x0, y0, x1, y1;  // half open
  };
  /// Returns the blocks that meet a window.
  [[nodiscard]] Blocks blocks_of(const LatticeWindow& window) const;
  [[nodiscard]] bool is_complete(std::int64_t x, std::int64_t y) const {
    return samples_[static_cast<std::size_t>(y * across_ + x)] == rectangle(x, y).size();
  }
  /// Adds the samples of a cluster. The mutexes guard rows of blocks.
  void add(const stream::Channel& channel, const stream::ClusterPoints& cluster,
           std::span<std::mutex> mutexes);
  [[nodiscard]] LatticeWindow rectangle(std::int64_t x, std::int64_t y) const {
    return {x * side_, y * side_, std::min(side_, columns_ - x * side_),
            std::min(side_, rows_ - y * side_)};
  }
  [[nodiscard]] const Block& at(std::int64_t x, std::int64_t y) const {
    return blocks_[static_cast<std::size_t>(y * across_ + x)];
  }

  std::int64_t side_ = 16;  ///< in samples
  std::int64_t columns_ = 0, rows_ = 0, across_ = 0, down_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::uint64_t> digests_;  ///< digests of blocks: sums over their samples
  std::vector<std::uint32_t> samples_;  ///< number of samples with data per block
};

/// A cache of heights of a raster store, in squares of the lattice, as floats where these are
/// exact. Keeps the most recently used. All threads share it: the first thread that needs a square
/// reads it, and the others wait.
class HeightCache {
 public:
  /// Keeps up to `bytes` of heights, but at least the squares in use: one per thread.
  HeightCache(const stream::Store& store, std::uint64_t bytes);
  HeightCache(const HeightCache&) = delete;
  HeightCache& operator=(const HeightCache&) = delete;

  /// As StoreWindow::heights() at full resolution. reader: the calling thread's reader of the same
  /// store, which reads missing squares. The window may have any size. Squares that do not fit into
  /// the cache are not kept. Throws: stream::Error on a damaged store, stream::Stopped.
  void heights(StoreWindow& reader, const LatticeWindow& window, std::span<double> out);

 private:
  static constexpr std::int64_t kSide = 256;
  /// In samples: a window this small is read alone, unless its squares are cached.
  static constexpr std::size_t kFew = 64;
  /// One of the two lists is empty.
  struct Square {
    std::int64_t number = 0;
    unsigned users = 0;  ///< threads that read or copy it; it is kept while there are any
    bool ready = false;  ///< false while it is being read
    std::vector<float> floats{};
    std::vector<double> doubles{};
  };
  using Squares = std::list<Square>;

  [[nodiscard]] bool has_all(const LatticeWindow& window) const;
  /// Makes the caller a user of a square, until release().
  Squares::iterator use(StoreWindow& reader, std::int64_t across, std::int64_t down);
  void release(Squares::iterator square);

  std::int64_t columns_, rows_, across_;
  bool floats_;
  std::size_t most_;  ///< in squares
  // Guards the members below, but not the heights of squares in use.
  mutable std::mutex mutex_;
  std::condition_variable read_;  ///< signals that a square was read, or that reading failed
  Squares squares_;               ///< most recently used first
  std::unordered_map<std::int64_t, Squares::iterator> by_number_;
};

}  // namespace terrace::terrain
