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

/// Heights of a raster store, window by window, those used last kept: in squares of the lattice, as
/// floats where these are exact. All threads share one: a square is read by the first that asks for
/// it, and the others wait.
class HeightCache {
 public:
  /// Keeps up to `bytes` of heights, but at least the squares at work: one per thread.
  HeightCache(const stream::Store& store, std::uint64_t bytes);
  HeightCache(const HeightCache&) = delete;
  HeightCache& operator=(const HeightCache&) = delete;

  /// As StoreWindow::heights() at full resolution. What is not there is read by `reader`, the
  /// calling thread's own for the same store. The window may be of any size: of what does not fit,
  /// nothing is kept. Throws: stream::Error on a damaged store, stream::Stopped.
  void heights(StoreWindow& reader, const LatticeWindow& window, std::span<double> out);

 private:
  static constexpr std::int64_t kSide = 256;
  /// Samples: so small a window is read alone, unless its squares are there.
  static constexpr std::size_t kFew = 64;
  /// One of the two lists is empty.
  struct Square {
    std::int64_t number = 0;
    unsigned users = 0;  ///< threads that read or copy it; it stays as long as there are some
    bool ready = false;  ///< else it is being read
    std::vector<float> floats{};
    std::vector<double> doubles{};
  };
  using Squares = std::list<Square>;

  [[nodiscard]] bool has_all(const LatticeWindow& window) const;
  /// The caller is one of its users until it releases it.
  Squares::iterator use(StoreWindow& reader, std::int64_t across, std::int64_t down);
  void release(Squares::iterator square);

  std::int64_t columns_, rows_, across_;
  bool floats_;
  std::size_t most_;  ///< squares
  // Guards what follows, but not the heights of squares in use.
  mutable std::mutex mutex_;
  std::condition_variable read_;  ///< a square, or it failed
  Squares squares_;               ///< the one used last in front
  std::unordered_map<std::int64_t, Squares::iterator> by_number_;
};

}  // namespace terrace::terrain
