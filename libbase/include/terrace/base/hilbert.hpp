// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <utility>

/// Hilbert curves through the cells of a square or a cube of 2^bits cells along each edge: cells
/// that are close on the curve are close in space. One table lookup per bit, or per four bits in
/// the plane.

namespace terrace::base {

namespace hilbert {

/// The plane: by orientation of a square (bit 0: x and y are swapped; bit 1: both are mirrored) and
/// four bits of each coordinate, eight bits of the index and the orientation of the small square.
/// The curve enters each square at one corner and leaves at a neighbouring one.
struct FourSteps {
  std::uint8_t places;
  std::uint8_t orientation;
};
constexpr std::array<FourSteps, 4 * 256> square_table() {
  std::array<FourSteps, 4 * 256> table{};
  for (unsigned start = 0; start < 4; ++start) {
    for (unsigned xy = 0; xy < 256; ++xy) {
      unsigned orientation = start, places = 0;
      for (unsigned bit = 4; bit-- > 0;) {
        unsigned x = xy >> (4 + bit) & 1, y = xy >> bit & 1;
        if ((orientation & 2) != 0) {
          x ^= 1;
          y ^= 1;
        }
        if ((orientation & 1) != 0) std::swap(x, y);
        // The basic square: (0,0) transposed, (0,1), (1,1), (1,0) transposed and mirrored.
        const unsigned place = x == 0 ? y : 3 - y;
        places = places << 2 | place;
        orientation ^= place == 0 ? 1u : place == 3 ? 3u : 0u;
      }
      table[start * 256 + xy] = {static_cast<std::uint8_t>(places),
                                 static_cast<std::uint8_t>(orientation)};
    }
  }
  return table;
}
inline constexpr auto kSquareTable = square_table();

/// Space: one step down the curve. A state is the corner where the curve enters a cube and the axis
/// along which it leaves: 8 * axis + corner. Source: C. Hamilton, A. Rau-Chaplin, Compact Hilbert
/// indices, 2008, doi:10.1016/j.ipl.2007.08.034.
struct Step {
  std::uint8_t place;
  std::uint8_t state;
};
constexpr unsigned rotated_left(unsigned bits, unsigned by) {
  by %= 3;
  return (bits << by | bits >> (3 - by)) & 7;
}
constexpr unsigned gray(unsigned i) { return i ^ i >> 1; }
constexpr Step cube_step(unsigned state, unsigned octant) {
  const auto trailing_ones = [](unsigned i) { return static_cast<unsigned>(std::countr_one(i)); };
  const unsigned corner = state % 8, axis = state / 8;
  const unsigned code = rotated_left(octant ^ corner, 3 - (axis + 1) % 3);
  unsigned place = 0;
  while (gray(place) != code) ++place;
  const unsigned entry = place == 0 ? 0 : gray((place - 1) / 2 * 2);
  const unsigned along = place == 0       ? 0
                         : place % 2 == 0 ? trailing_ones(place - 1) % 3
                                          : trailing_ones(place) % 3;
  const unsigned next_corner = corner ^ rotated_left(entry, axis + 1);
  const unsigned next_axis = (axis + along + 1) % 3;
  return {static_cast<std::uint8_t>(place), static_cast<std::uint8_t>(8 * next_axis + next_corner)};
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

/// The position of a cell of a square on the curve, from 0. Bits: a multiple of 4, at most 32;
/// coordinates must be below 2^Bits. The curve begins in (0, 0) and ends in (2^Bits - 1, 0).
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y) {
  static_assert(Bits % 4 == 0 && Bits > 0 && Bits <= 32);
  std::uint64_t index = 0;
  unsigned orientation = 0;
  for (unsigned shift = Bits; shift > 0;) {
    shift -= 4;
    const hilbert::FourSteps& step =
        hilbert::kSquareTable[orientation * 256 + (x >> shift & 15) * 16 + (y >> shift & 15)];
    index = index << 8 | step.places;
    orientation = step.orientation;
  }
  return index;
}

/// The position of a cell of a cube on the curve, from 0. Bits: at most 21; coordinates must be
/// below 2^Bits. The curve begins in (0, 0, 0).
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y,
                                                    std::uint32_t z) {
  static_assert(Bits > 0 && Bits <= 21);
  std::uint64_t index = 0;
  unsigned state = 0;
  for (unsigned bit = Bits; bit-- > 0;) {
    const unsigned octant = (x >> bit & 1) << 2 | (y >> bit & 1) << 1 | (z >> bit & 1);
    const hilbert::Step& step = hilbert::kCubeTable[state * 8 + octant];
    index = index << 3 | step.place;
    state = step.state;
  }
  return index;
}

}  // namespace terrace::base
