// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Heights of a raster store, window by window, those used last kept: in squares of the lattice, as
/// floats where these are exact. One object per thread.
class HeightCache {
 public:
  /// Keeps up to `bytes` of heights; beside them 12 MiB of what is decoded.
  HeightCache(const stream::Store& store, std::uint64_t bytes);
  HeightCache(const HeightCache&) = delete;
  HeightCache& operator=(const HeightCache&) = delete;

  /// As StoreWindow::heights() at full resolution. The window may be of any size: of what does not
  /// fit, nothing is kept. Throws: stream::Error on a damaged store, stream::Stopped.
  void heights(const LatticeWindow& window, std::span<double> out);

 private:
  static constexpr std::int64_t kSide = 256;
  /// Samples: so small a window is read alone, unless its squares are there.
  static constexpr std::size_t kFew = 64;
  /// One of the two is empty.
  struct Square {
    std::int64_t number = 0;
    std::vector<float> floats;
    std::vector<double> doubles;
  };
  using Squares = std::list<Square>;

  [[nodiscard]] bool has_all(const LatticeWindow& window) const;
  const Square& square(std::int64_t across, std::int64_t down);

  StoreWindow reader_;
  std::int64_t columns_, rows_, across_;
  bool floats_;
  std::size_t most_;  ///< squares
  Squares squares_;   ///< the one used last in front
  std::unordered_map<std::int64_t, Squares::iterator> by_number_;
};

}  // namespace terrace::terrain
