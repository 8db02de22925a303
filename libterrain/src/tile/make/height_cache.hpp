// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// A cache of heights of a raster store, in squares of the lattice, as floats where these are
/// exact. Keeps the most recently used. All threads share it: the first thread that needs a square
/// reads it, and the others wait.
class HeightCache {
 public:
  /// Keeps up to `bytes` of heights, but at least the squares in use: one per thread.
  HeightCache(const stream::Store& store, std::uint64_t bytes);
  HeightCache(const HeightCache&) = delete;
  HeightCache& operator=(const HeightCache&) = delete;

  /// As StoreWindow::heights() at full resolution. `reader`, the calling thread's own for the same
  /// store, reads what is not cached. The window may have any size; squares that do not fit are not
  /// kept. Throws: stream::Error on a damaged store, stream::Stopped.
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
