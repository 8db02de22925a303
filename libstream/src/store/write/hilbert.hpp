// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace terrace::stream::store {

/// When the Hilbert curve through all cells of a square or cube of 2^bits a side comes to `cell`,
/// counted from 0. Requires coordinates below 2^bits and cell.size() * bits <= 64.
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
inline std::uint64_t hilbert_place(std::span<std::uint32_t> cell, unsigned bits) {
  // From the corner's octant inwards, turned as the curve is there.
  for (std::uint32_t bit = std::uint32_t{1} << (bits - 1); bit > 1; bit >>= 1) {
    const std::uint32_t below = bit - 1;
    for (std::uint32_t& x : cell) {
      if ((x & bit) != 0) {
        cell[0] ^= below;
      } else {
        const std::uint32_t exchanged = (cell[0] ^ x) & below;  // 0 on the first axis
        cell[0] ^= exchanged;
        x ^= exchanged;
      }
    }
  }
  // From Gray code to binary.
  for (std::size_t axis = 1; axis < cell.size(); ++axis) cell[axis] ^= cell[axis - 1];
  std::uint32_t flipped = 0;
  for (std::uint32_t bit = std::uint32_t{1} << (bits - 1); bit > 1; bit >>= 1) {
    if ((cell.back() & bit) != 0) flipped ^= bit - 1;
  }
  std::uint64_t place = 0;
  for (unsigned bit = bits; bit-- > 0;) {
    for (const std::uint32_t x : cell) place = (place << 1) | (((x ^ flipped) >> bit) & 1);
  }
  return place;
}

}  // namespace terrace::stream::store
