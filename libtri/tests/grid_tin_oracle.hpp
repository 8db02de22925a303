// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "grid_windows.hpp"
#include "terrace/tri/grid_tin.hpp"

/// Shared by tests of meshes of grids: windows meshed individually, and brute-force checks of the
/// result.

namespace terrace::tri::grid_tin_oracle {

using Corners = std::array<std::array<std::int64_t, 2>, 3>;

inline constexpr TinQuality kQualities[] = {TinQuality::greedy, TinQuality::removal,
                                            TinQuality::fitted};

inline std::int64_t turn(const std::array<std::int64_t, 2>& a, const std::array<std::int64_t, 2>& b,
                         const std::array<std::int64_t, 2>& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Corners with columns to the right and rows upwards.
inline Corners corners_of(const GridTin& tin, std::size_t i) {
  Corners result;
  for (std::size_t k = 0; k < 3; ++k) {
    const GridVertex& v = tin.vertices[tin.triangles[i][k]];
    result[k] = {v.column, v.row};
  }
  return result;
}

/// Tests every sample against every triangle, with integer positions. Returns the greatest error.
template <class T>
double brute_force(const OwnedWindow<T>& owned, const GridTin& tin, bool gaps) {
  double most = 0;
  std::int64_t area = 0;
  std::vector<bool> covered(owned.heights.size());
  for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
    Corners t = corners_of(tin, i);
    std::array<long double, 3> z{};
    for (std::size_t k = 0; k < 3; ++k) z[k] = tin.vertices[tin.triangles[i][k]].height;
    // Rows grow southward unless stated otherwise, so triangles are clockwise on the lattice.
    std::int64_t twice = turn(t[0], t[1], t[2]);
    EXPECT_LT(twice, 0) << "triangle " << i;
    std::swap(t[1], t[2]);
    std::swap(z[1], z[2]);
    twice = -twice;
    area += twice;
    for (std::uint32_t y = 0; y < owned.rows; ++y) {
      for (std::uint32_t x = 0; x < owned.columns; ++x) {
        const std::array<std::int64_t, 2> p{x, y};
        const std::int64_t w[3] = {turn(t[1], t[2], p), turn(t[2], t[0], p), turn(t[0], t[1], p)};
        if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
        const T height = owned.at(x, y);
        EXPECT_TRUE(std::isfinite(height)) << "no data at " << x << ", " << y;
        covered[std::size_t{y} * owned.columns + x] = true;
        // Relative to the sample, so that the result is exact if heights are equal.
        long double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
          sum += static_cast<long double>(w[k]) * (z[k] - static_cast<long double>(height));
        most =
            std::max(most, static_cast<double>(std::fabs(sum / static_cast<long double>(twice))));
      }
    }
  }
  for (std::uint32_t y = 0; y < owned.rows; ++y) {
    for (std::uint32_t x = 0; x < owned.columns; ++x) {
      bool inner = true;
      for (std::uint32_t v = y == 0 ? 0 : y - 1; v <= y + 1 && v < owned.rows; ++v)
        for (std::uint32_t u = x == 0 ? 0 : x - 1; u <= x + 1 && u < owned.columns; ++u)
          inner = inner && std::isfinite(owned.at(u, v));
      if (inner) {
        EXPECT_TRUE(covered[std::size_t{y} * owned.columns + x]) << x << ", " << y;
      }
    }
  }
  if (!gaps && owned.rows > 1 && owned.columns > 1) {
    EXPECT_EQ(area, 2 * std::int64_t{owned.columns - 1} * (owned.rows - 1));
  }
  return most;
}

template <class T>
GridTin make(const OwnedWindow<T>& owned, double bound, TinQuality quality, double column_step = 1,
             double row_step = -1) {
  GridTinOptions options;
  options.max_error = bound;
  options.quality = quality;
  options.column_step = column_step;
  options.row_step = row_step;
  return grid_tin(owned.window(), settle_sides(owned.window(), bound), options);
}

}  // namespace terrace::tri::grid_tin_oracle
