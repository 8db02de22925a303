// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

/// Point sets for the tests of the planar triangulation, regular and degenerate.

namespace terrace::tri {

enum class PointSet {
  uniform,     ///< 26 bits (integers), [0, 1) (doubles)
  few_bits,    ///< 5 bits: duplicates, cocircular and collinear points everywhere
  seven_bits,  ///< 7 bits: cocircular points, fewer duplicates
  grid,        ///< a complete grid, row by row
  horizontal,  ///< on one line
  slanted,     ///< on one line, with duplicates
  off_line,    ///< collinear except the last point
  circle,      ///< cocircular: integer points on one circle, then its centre
  clusters,    ///< tight clusters far apart
  huge,        ///< at the ends of the range
  tiny,        ///< doubles near the smallest; integers 0..3
};
inline constexpr PointSet kPointSets[] = {
    PointSet::uniform,    PointSet::few_bits, PointSet::seven_bits, PointSet::grid,
    PointSet::horizontal, PointSet::slanted,  PointSet::off_line,   PointSet::circle,
    PointSet::clusters,   PointSet::huge,     PointSet::tiny};

inline std::string name(PointSet kind) {
  constexpr const char* kNames[] = {"uniform",    "few bits", "seven bits", "grid",
                                    "horizontal", "slanted",  "off line",   "circle",
                                    "clusters",   "huge",     "tiny"};
  return kNames[static_cast<std::size_t>(kind)];
}

inline double to_unit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

template <class Coord>
std::vector<std::array<Coord, 2>> make_points(PointSet kind, std::size_t count,
                                              std::uint64_t seed) {
  constexpr bool kDouble = std::is_same_v<Coord, double>;
  std::mt19937_64 random(seed);
  const auto below = [&](std::uint64_t bound) { return static_cast<Coord>(random() % bound); };
  std::vector<std::array<Coord, 2>> points;
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<Coord>(i);
    std::array<Coord, 2> p{};
    switch (kind) {
      case PointSet::uniform:
        if constexpr (kDouble) {
          p = {to_unit(random()), to_unit(random())};
        } else {
          p = {below(1 << 26), below(1 << 26)};
        }
        break;
      case PointSet::few_bits:
        p = {below(32), below(32)};
        if constexpr (kDouble) p = {p[0] * 0.1, p[1] * 0.1};
        break;
      case PointSet::seven_bits:
        p = {below(128), below(128)};
        break;
      case PointSet::grid:
        p = {static_cast<Coord>(i % side * 7), static_cast<Coord>(i / side * 7)};
        break;
      case PointSet::horizontal:
        p = {below(1 << 20), Coord{5}};
        break;
      case PointSet::slanted:
        p[0] = below(100);
        p[1] = 3 * p[0] + 1;
        break;
      case PointSet::off_line:
        p = {k, 2 * k};
        if (i + 1 == count) p[1] += 1;
        break;
      case PointSet::circle: {
        // A radius of 65 * 17 * 29 has many Pythagorean points.
        constexpr std::int64_t kRadius = 32045;
        if (i + 1 == count) {
          p = {Coord{kRadius}, Coord{kRadius}};
          break;
        }
        std::int64_t x = 0;
        std::int64_t y = 0;
        do {
          const auto m = static_cast<std::int64_t>(random() % 180);
          const auto n = static_cast<std::int64_t>(random() % 180);
          const std::int64_t norm = m * m + n * n;
          if (norm == 0 || kRadius % norm != 0) continue;
          const std::int64_t scale = kRadius / norm;
          x = scale * (m * m - n * n);
          y = scale * 2 * m * n;
        } while (x == 0 && y == 0);
        if (random() % 2 == 0) std::swap(x, y);
        if (random() % 2 == 0) x = -x;
        if (random() % 2 == 0) y = -y;
        p = {static_cast<Coord>(kRadius + x), static_cast<Coord>(kRadius + y)};
        break;
      }
      case PointSet::clusters: {
        const std::uint64_t cluster = random() % 5;
        p = {static_cast<Coord>(cluster * 200'000'000 + random() % 40),
             static_cast<Coord>(cluster * cluster * 50'000'000 + random() % 40)};
        break;
      }
      case PointSet::huge:
        if constexpr (kDouble) {
          p = {(to_unit(random()) - 0.5) * 0x1p1023, (to_unit(random()) - 0.5) * 0x1p1023};
        } else {
          constexpr std::int32_t kLast = (1 << 30) - 1;
          p = {random() % 2 == 0 ? below(3) : kLast - below(3),
               random() % 3 == 0 ? below(1 << 30) : kLast - below(2)};
        }
        break;
      case PointSet::tiny:
        p = {below(4), below(4)};
        if constexpr (kDouble) {
          const double unit = 0x1p-1074 * static_cast<double>(1 + random() % 3);
          p = {static_cast<double>(random() % 8) * unit, static_cast<double>(random() % 8) * -unit};
        }
        break;
    }
    points.push_back(p);
  }
  return points;
}

}  // namespace terrace::tri
