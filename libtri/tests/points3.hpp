// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

/// Point sets for the tests of the spatial triangulation, regular and degenerate.

namespace terrace::tri {

enum class PointSet3 {
  uniform,     ///< 21 bits (integers), [0, 1) (doubles)
  full_range,  ///< 30 bits (integers), [-1e9, 1e9) (doubles)
  few_bits,    ///< 3 bits: duplicates, cospherical, coplanar and collinear points everywhere
  five_bits,   ///< 5 bits: cospherical points, fewer duplicates
  grid,        ///< a complete grid, row by row
  slab,        ///< two layers of a grid
  line,        ///< on one line, with duplicates
  plane,       ///< in one plane, with duplicates
  off_plane,   ///< coplanar except the last point
  sphere,      ///< cospherical: integer points on one sphere, then its centre
  curves,      ///< on two skew lines: every pair of edges makes a tetrahedron
  clusters,    ///< tight clusters far apart
  huge,        ///< at the ends of the range
  tiny,        ///< doubles near the smallest; integers 0..3
};
inline constexpr PointSet3 kPointSets3[] = {
    PointSet3::uniform,   PointSet3::full_range, PointSet3::few_bits, PointSet3::five_bits,
    PointSet3::grid,      PointSet3::slab,       PointSet3::line,     PointSet3::plane,
    PointSet3::off_plane, PointSet3::sphere,     PointSet3::curves,   PointSet3::clusters,
    PointSet3::huge,      PointSet3::tiny};

inline std::string name(PointSet3 kind) {
  constexpr const char* kNames[] = {"uniform", "full range", "few bits", "five bits", "grid",
                                    "slab",    "line",       "plane",    "off plane", "sphere",
                                    "curves",  "clusters",   "huge",     "tiny"};
  return kNames[static_cast<std::size_t>(kind)];
}

template <class Coord>
std::vector<std::array<Coord, 3>> make_points3(PointSet3 kind, std::size_t count,
                                               std::uint64_t seed) {
  constexpr bool kDouble = std::is_same_v<Coord, double>;
  std::mt19937_64 random(seed);
  const auto below = [&](std::uint64_t bound) { return static_cast<Coord>(random() % bound); };
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<std::array<Coord, 3>> points;
  const auto side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(count))));
  const auto slab = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count) / 2)));
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<Coord>(i);
    std::array<Coord, 3> p{};
    switch (kind) {
      case PointSet3::uniform:
        if constexpr (kDouble) {
          p = {unit(), unit(), unit()};
        } else {
          p = {below(1 << 21), below(1 << 21), below(1 << 21)};
        }
        break;
      case PointSet3::full_range:
        if constexpr (kDouble) {
          p = {(unit() - 0.5) * 2e9, (unit() - 0.5) * 2e9, (unit() - 0.5) * 2e9};
        } else {
          p = {below(1 << 30), below(1 << 30), below(1 << 30)};
        }
        break;
      case PointSet3::few_bits:
        p = {below(8), below(8), below(8)};
        if constexpr (kDouble) p = {p[0] * 0.1, p[1] * 0.1, p[2] * 0.1};
        break;
      case PointSet3::five_bits:
        p = {below(32), below(32), below(32)};
        break;
      case PointSet3::grid:
        p = {static_cast<Coord>(i % side * 7), static_cast<Coord>(i / side % side * 7),
             static_cast<Coord>(i / side / side * 7)};
        break;
      case PointSet3::slab:
        p = {static_cast<Coord>(i % slab), static_cast<Coord>(i / slab % slab),
             static_cast<Coord>(i / slab / slab)};
        break;
      case PointSet3::line:
        p[0] = below(100);
        p[1] = 3 * p[0] + 1;
        p[2] = 2 * p[0];
        break;
      case PointSet3::plane:
        p = {below(20), below(20), 0};
        p[2] = p[0] + 2 * p[1];
        break;
      case PointSet3::off_plane:
        p = {below(20), below(20), 0};
        p[2] = p[0] + 2 * p[1] + (i + 1 == count ? 1 : 0);
        break;
      case PointSet3::sphere: {
        // Uses the parametrisation of x^2 + y^2 + z^2 = r^2 by four integers.
        constexpr std::int64_t kRadius = 3 * 5 * 7 * 11 * 13;
        if (i + 1 == count) {
          p = {Coord{kRadius}, Coord{kRadius}, Coord{kRadius}};
          break;
        }
        std::int64_t norm = 0;
        std::array<std::int64_t, 4> q{};
        do {
          for (auto& c : q) c = static_cast<std::int64_t>(random() % 17) - 8;
          norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        } while (norm == 0 || kRadius % norm != 0);
        const std::int64_t scale = kRadius / norm;
        p = {static_cast<Coord>(kRadius +
                                scale * (q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3])),
             static_cast<Coord>(kRadius + scale * 2 * (q[0] * q[3] + q[1] * q[2])),
             static_cast<Coord>(kRadius + scale * 2 * (q[1] * q[3] - q[0] * q[2]))};
        break;
      }
      case PointSet3::curves:
        if (i % 2 == 0) {
          p = {k, 500, 500};
        } else {
          p = {500, k, 600};
        }
        break;
      case PointSet3::clusters: {
        const std::uint64_t cluster = random() % 5;
        p = {static_cast<Coord>(cluster * 200'000'000 + random() % 12),
             static_cast<Coord>(cluster * cluster * 50'000'000 + random() % 12),
             static_cast<Coord>(cluster % 2 * 3'000 + random() % 12)};
        break;
      }
      case PointSet3::huge:
        if constexpr (kDouble) {
          p = {(unit() - 0.5) * 0x1p1023, (unit() - 0.5) * 0x1p1023, (unit() - 0.5) * 0x1p1023};
        } else {
          constexpr std::int32_t kLast = (1 << 30) - 1;
          p = {random() % 2 == 0 ? below(3) : kLast - below(3),
               random() % 3 == 0 ? below(1 << 30) : kLast - below(2),
               random() % 2 == 0 ? below(2) : kLast - below(4)};
        }
        break;
      case PointSet3::tiny:
        p = {below(4), below(4), below(4)};
        if constexpr (kDouble) {
          const double step = 0x1p-1074 * static_cast<double>(1 + random() % 3);
          p = {static_cast<double>(random() % 8) * step, static_cast<double>(random() % 8) * -step,
               static_cast<double>(random() % 8) * step};
        }
        break;
    }
    points.push_back(p);
  }
  return points;
}

}  // namespace terrace::tri
