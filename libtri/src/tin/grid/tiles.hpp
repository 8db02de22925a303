// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace terrace::tri::tin {

/// Squares of 32 x 32 samples, so small that the triangles of one fit the nearest cache; numbered
/// to and fro, so that each is next to the one before.
class GridTiles {
 public:
  GridTiles(std::int32_t columns, std::int32_t rows)
      : across_((columns >> kBits) + 1), down_((rows >> kBits) + 1) {}

  std::size_t count() const {
    return static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_);
  }

  std::uint32_t of(std::int32_t x, std::int32_t y) const {
    const std::int32_t row = y >> kBits, column = x >> kBits;
    return static_cast<std::uint32_t>(row * across_ +
                                      (row % 2 == 0 ? column : across_ - 1 - column));
  }

 private:
  static constexpr int kBits = 5;
  std::int32_t across_, down_;
};

}  // namespace terrace::tri::tin
