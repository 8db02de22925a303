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
  kFlat,
  kRamp,
  kSteps,
  kNoise,   ///< independent samples in the range of 16 bits
  kHills,   ///< smooth, of integers
  kSpikes,  ///< flat with a few samples far off
  kLake,    ///< hills with flat water
  kHuge,    ///< about 1e30
  kTiny,    ///< about 1e-30
};
inline constexpr Relief kReliefs[] = {Relief::kFlat,  Relief::kRamp,  Relief::kSteps,
                                      Relief::kNoise, Relief::kHills, Relief::kSpikes,
                                      Relief::kLake,  Relief::kHuge,  Relief::kTiny};

enum class Gaps {
  kNone,
  kSprinkled,  ///< single samples
  kHalf,       ///< on one side of a slanted line
  kBlobs,      ///< round holes
  kIslands,    ///< round islands
  kFrame,      ///< along all four sides
  kMost,       ///< 9 of 10 samples
};
inline constexpr Gaps kGapPatterns[] = {Gaps::kNone,    Gaps::kSprinkled, Gaps::kHalf, Gaps::kBlobs,
                                        Gaps::kIslands, Gaps::kFrame,     Gaps::kMost};

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
        case Relief::kFlat:
          z = 17;
          break;
        case Relief::kRamp:
          z = 3 * x - 7 * y;
          break;
        case Relief::kSteps:
          z = 50 * std::floor((x + 2 * y) / 9);
          break;
        case Relief::kNoise:
          z = std::floor(65536 * unit()) - 32768;
          break;
        case Relief::kHills:
          z = hills;
          break;
        case Relief::kSpikes:
          z = unit() < 0.02 ? std::floor(2000 * unit() - 1000) : 5;
          break;
        case Relief::kLake:
          z = std::fmax(hills, 0);
          break;
        case Relief::kHuge:
          z = 1e30 * (unit() - 0.5);
          break;
        case Relief::kTiny:
          z = 1e-30 * (unit() - 0.5);
          break;
      }
      bool in_disc = false;
      for (const Disc& disc : discs)
        in_disc |= (x - disc.x) * (x - disc.x) + (y - disc.y) * (y - disc.y) < disc.r * disc.r;
      const double chance = unit();
      bool missing = false;
      switch (gaps) {
        case Gaps::kNone:
          break;
        case Gaps::kSprinkled:
          missing = chance < 0.02;
          break;
        case Gaps::kHalf:
          missing = y - rows * 0.5 > slope * (x - columns * 0.5);
          break;
        case Gaps::kBlobs:
          missing = in_disc;
          break;
        case Gaps::kIslands:
          missing = !in_disc;
          break;
        case Gaps::kFrame:
          missing = row < 2 || column < 3 || row + 3 > rows || column + 2 > columns;
          break;
        case Gaps::kMost:
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
    case Relief::kNoise:
      return 9000;
    case Relief::kHuge:
      return 2e29;
    case Relief::kTiny:
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
