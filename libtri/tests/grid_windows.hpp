// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "terrace/tri/grid_tin.hpp"

/// Windows for the tests of meshes of grids, regular and degenerate.

namespace terrace::tri {

/// A missing sample.
inline constexpr double kNoHeight = std::numeric_limits<double>::quiet_NaN();

enum class Relief {
  flat,
  ramp,
  steps,
  noise,   ///< independent samples in the range of 16 bits
  hills,   ///< smooth, of integers
  spikes,  ///< flat with a few samples far off
  lake,    ///< hills with flat water
  huge,    ///< about 1e30
  tiny,    ///< about 1e-30
};
inline constexpr Relief kReliefs[] = {Relief::flat,  Relief::ramp,  Relief::steps,
                                      Relief::noise, Relief::hills, Relief::spikes,
                                      Relief::lake,  Relief::huge,  Relief::tiny};

enum class Gaps {
  none,
  sprinkled,  ///< single samples
  half,       ///< on one side of a slanted line
  blobs,      ///< round holes
  islands,    ///< round islands
  frame,      ///< along all four sides
  most,       ///< 9 of 10 samples
};
inline constexpr Gaps kGapPatterns[] = {Gaps::none,    Gaps::sprinkled, Gaps::half, Gaps::blobs,
                                        Gaps::islands, Gaps::frame,     Gaps::most};

/// A window with its samples.
template <class T>
struct OwnedWindow {
  std::uint32_t columns, rows;
  std::vector<T> heights;
  GridWindow<T> window() const { return {columns, rows, heights}; }
  T at(std::uint32_t x, std::uint32_t y) const { return heights[std::size_t{y} * columns + x]; }
};

template <class T>
OwnedWindow<T> make_window(Relief relief, Gaps gaps, std::uint32_t columns, std::uint32_t rows,
                           std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  OwnedWindow<T> result{columns, rows, {}};
  const double a = 0.1 + 0.3 * unit(), b = 0.1 + 0.3 * unit(), c = 6 * unit();
  const double slope = 2 * unit() - 1;
  struct Disc {
    double x, y, r;
  };
  std::vector<Disc> discs;
  for (int i = 0; i < 4; ++i)
    discs.push_back({unit() * columns, unit() * rows, (0.05 + 0.2 * unit()) * columns});
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double x = column, y = row;
      const double hills =
          std::floor(200 * (std::sin(a * x + c) * std::cos(b * y) + std::sin(0.11 * (x + y))));
      double z = 0;
      switch (relief) {
        case Relief::flat:
          z = 17;
          break;
        case Relief::ramp:
          z = 3 * x - 7 * y;
          break;
        case Relief::steps:
          z = 50 * std::floor((x + 2 * y) / 9);
          break;
        case Relief::noise:
          z = std::floor(65536 * unit()) - 32768;
          break;
        case Relief::hills:
          z = hills;
          break;
        case Relief::spikes:
          z = unit() < 0.02 ? std::floor(2000 * unit() - 1000) : 5;
          break;
        case Relief::lake:
          z = std::fmax(hills, 0);
          break;
        case Relief::huge:
          z = 1e30 * (unit() - 0.5);
          break;
        case Relief::tiny:
          z = 1e-30 * (unit() - 0.5);
          break;
      }
      bool in_disc = false;
      for (const Disc& disc : discs)
        in_disc |= (x - disc.x) * (x - disc.x) + (y - disc.y) * (y - disc.y) < disc.r * disc.r;
      const double chance = unit();
      bool missing = false;
      switch (gaps) {
        case Gaps::none:
          break;
        case Gaps::sprinkled:
          missing = chance < 0.02;
          break;
        case Gaps::half:
          missing = y - rows * 0.5 > slope * (x - columns * 0.5);
          break;
        case Gaps::blobs:
          missing = in_disc;
          break;
        case Gaps::islands:
          missing = !in_disc;
          break;
        case Gaps::frame:
          missing = row < 2 || column < 3 || row + 3 > rows || column + 2 > columns;
          break;
        case Gaps::most:
          missing = chance < 0.9;
          break;
      }
      result.heights.push_back(missing ? std::numeric_limits<T>::quiet_NaN() : static_cast<T>(z));
    }
  }
  return result;
}

/// An error bound that leaves work to do.
inline double bound_for(Relief relief) {
  switch (relief) {
    case Relief::noise:
      return 9000;
    case Relief::huge:
      return 2e29;
    case Relief::tiny:
      return 2e-31;
    default:
      return 12;
  }
}

inline std::string describe(Relief relief, Gaps gaps, std::uint32_t columns, std::uint32_t rows,
                            std::uint64_t seed) {
  return "relief " + std::to_string(static_cast<int>(relief)) + ", gaps " +
         std::to_string(static_cast<int>(gaps)) + ", " + std::to_string(columns) + " x " +
         std::to_string(rows) + ", seed " + std::to_string(seed);
}

}  // namespace terrace::tri
