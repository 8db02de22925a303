// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <utility>

/// Hilbert curves through the cells of a square or a cube with 2^bits cells along each edge. Cells
/// that are close on the curve are close in space. An index takes one table lookup per bit in
/// space, and one per four bits in the plane.

namespace terrace::base {

namespace hilbert {

/// Four steps down the curve in the plane. An orientation has two bits: bit 0 swaps x and y, bit 1
/// mirrors both. The curve enters each square at one corner and leaves at a neighbouring one.
struct FourSteps {
  std::uint8_t index;        ///< eight bits of the index
  std::uint8_t orientation;  ///< orientation of the small square
};
/// Returns the steps for each orientation of a square (4) and four bits of x and of y (16 * 16).
constexpr std::array<FourSteps, 4 * 256> square_table() {
  std::array<FourSteps, 4 * 256> table{};
  for (unsigned start = 0; start < 4; ++start) {
    for (unsigned xy = 0; xy < 256; ++xy) {
      unsigned orientation = start, index = 0;
      for (unsigned bit = 4; bit-- > 0;) {
        unsigned x = xy >> (4 + bit) & 1, y = xy >> bit & 1;
        if ((orientation & 2) != 0) {
          x ^= 1;
          y ^= 1;
        }
        if ((orientation & 1) != 0) std::swap(x, y);
        // The basic square: (0,0) transposed, (0,1), (1,1), (1,0) transposed and mirrored.
        const unsigned quadrant = x == 0 ? y : 3 - y;
        index = index << 2 | quadrant;
        orientation ^= quadrant == 0 ? 1u : quadrant == 3 ? 3u : 0u;
      }
      table[start * 256 + xy] = {static_cast<std::uint8_t>(index),
                                 static_cast<std::uint8_t>(orientation)};
    }
  }
  return table;
}
inline constexpr auto kSquareTable = square_table();

/// One step down the curve in space. A state, 8 * axis + corner, consists of the corner where the
/// curve enters a cube and the axis along which it leaves. Source: C. Hamilton, A. Rau-Chaplin,
/// Compact Hilbert indices, 2008, doi:10.1016/j.ipl.2007.08.034.
struct Step {
  std::uint8_t index;  ///< three bits of the index
  std::uint8_t state;
};
/// Rotates three bits to the left.
constexpr unsigned rotate_left(unsigned bits, unsigned count) {
  count %= 3;
  return (bits << count | bits >> (3 - count)) & 7;
}
constexpr unsigned gray(unsigned i) { return i ^ i >> 1; }
constexpr Step cube_step(unsigned state, unsigned octant) {
  const auto trailing_ones = [](unsigned i) { return static_cast<unsigned>(std::countr_one(i)); };
  const unsigned corner = state % 8, axis = state / 8;
  const unsigned code = rotate_left(octant ^ corner, 3 - (axis + 1) % 3);
  unsigned index = 0;
  while (gray(index) != code) ++index;
  const unsigned entry = index == 0 ? 0 : gray((index - 1) / 2 * 2);
  const unsigned along = index == 0       ? 0
                         : index % 2 == 0 ? trailing_ones(index - 1) % 3
                                          : trailing_ones(index) % 3;
  const unsigned next_corner = corner ^ rotate_left(entry, axis + 1);
  const unsigned next_axis = (axis + along + 1) % 3;
  return {static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(8 * next_axis + next_corner)};
}
constexpr std::array<Step, 24 * 8> cube_table() {
  std::array<Step, 24 * 8> table{};
  for (unsigned state = 0; state < 24; ++state) {
    for (unsigned octant = 0; octant < 8; ++octant) {
      table[state * 8 + octant] = cube_step(state, octant);
    }
  }
  return table;
}
inline constexpr auto kCubeTable = cube_table();

}  // namespace hilbert

/// Returns the position of a cell of a square on the curve, from 0. Bits is a multiple of 4, at
/// most
/// 32. Requires coordinates below 2^Bits. The curve begins in (0, 0) and ends in (2^Bits - 1, 0).
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y) {
  static_assert(Bits % 4 == 0 && Bits > 0 && Bits <= 32);
  std::uint64_t index = 0;
  unsigned orientation = 0;
  for (unsigned shift = Bits; shift > 0;) {
    shift -= 4;
    const hilbert::FourSteps& step =
        hilbert::kSquareTable[orientation * 256 + (x >> shift & 15) * 16 + (y >> shift & 15)];
    index = index << 8 | step.index;
    orientation = step.orientation;
  }
  return index;
}

/// Returns the position of a cell of a cube on the curve, from 0. Bits is at most 21. Requires
/// coordinates below 2^Bits. The curve begins in (0, 0, 0).
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y,
                                                    std::uint32_t z) {
  static_assert(Bits > 0 && Bits <= 21);
  std::uint64_t index = 0;
  unsigned state = 0;
  for (unsigned bit = Bits; bit-- > 0;) {
    const unsigned octant = (x >> bit & 1) << 2 | (y >> bit & 1) << 1 | (z >> bit & 1);
    const hilbert::Step& step = hilbert::kCubeTable[state * 8 + octant];
    index = index << 3 | step.index;
    state = step.state;
  }
  return index;
}

}  // namespace terrace::base
