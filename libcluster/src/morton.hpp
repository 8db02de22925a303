// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::cluster {

/// Spreads the low ten bits of v to every third bit.
inline std::uint32_t spread_by_three(std::uint32_t v) {
  v &= 0x3ff;
  v = (v | (v << 16)) & 0x030000ff;
  v = (v | (v << 8)) & 0x0300f00f;
  v = (v | (v << 4)) & 0x030c30c3;
  v = (v | (v << 2)) & 0x09249249;
  return v;
}

/// The place along the Z-order curve of a cell of a grid of 1024^3.
inline std::uint32_t morton_code(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_by_three(x) | (spread_by_three(y) << 1) | (spread_by_three(z) << 2);
}

}  // namespace terrace::cluster
