// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "grid_tin_oracle.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace {

using namespace terrace::tri;
using namespace terrace::tri::grid_tin_oracle;

__extension__ typedef __int128 Int128;

/// Sorted, so that equal triangles compare equal.
Corners key_of(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

double smallest_angle(const Corners& t, double dx, double dy) {
  double least = 180;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto &p = t[i], &q = t[(i + 1) % 3], &r = t[(i + 2) % 3];
    const double ux = dx * static_cast<double>(q[0] - p[0]);
    const double uy = dy * static_cast<double>(q[1] - p[1]);
    const double vx = dx * static_cast<double>(r[0] - p[0]);
    const double vy = dy * static_cast<double>(r[1] - p[1]);
    least = std::min(least, std::atan2(std::fabs(ux * vy - uy * vx), ux * vx + uy * vy) * 57.29578);
  }
  return least;
}

bool in_circle(const std::array<std::int64_t, 2>& a, const std::array<std::int64_t, 2>& b,
               const std::array<std::int64_t, 2>& c, const std::array<std::int64_t, 2>& p,
               std::int64_t wx, std::int64_t wy) {
  const auto row = [&](const std::array<std::int64_t, 2>& q) {
    const std::int64_t x = q[0] - p[0], y = q[1] - p[1];
    return std::array<Int128, 3>{x, y, wx * x * x + wy * y * y};
  };
  const auto u = row(a), v = row(b), w = row(c);
  const Int128 det = u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
                     u[2] * (v[0] * w[1] - v[1] * w[0]);
  return det > 0;
}

TEST(GridTin, GreedyIsDelaunayOnTheGround) {
  struct Steps {
    double x, y;
    std::int64_t wx, wy;
  };
  for (const Steps& steps : {Steps{1, -1, 1, 1}, Steps{2, -1, 4, 1}, Steps{0.5, -1, 1, 4}}) {
    for (const Relief relief : {Relief::hills, Relief::noise, Relief::lake, Relief::steps}) {
      SCOPED_TRACE(describe(relief, Gaps::none, 45, 38, 9));
      const auto owned = make_window<float>(relief, Gaps::none, 45, 38, 9);
      const GridTin tin = make(owned, bound_for(relief), TinQuality::greedy, steps.x, steps.y);
      for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
        const Corners t = corners_of(tin, i);
        for (const GridVertex& v : tin.vertices)
          ASSERT_FALSE(in_circle(t[0], t[2], t[1], {v.column, v.row}, steps.wx, steps.wy));
      }
    }
  }
}

TEST(GridTin, RemovalAvoidsThinTriangles) {
  for (const double row_step : {-1.0, -0.6, -2.5}) {
    for (const Relief relief : {Relief::hills, Relief::noise, Relief::lake, Relief::flat}) {
      for (const Gaps gaps : {Gaps::none, Gaps::blobs}) {
        SCOPED_TRACE(describe(relief, gaps, 90, 80, 4));
        const auto owned = make_window<float>(relief, gaps, 90, 80, 4);
        const double bound = bound_for(relief);
        const GridTin greedy = make(owned, bound, TinQuality::greedy, 1, row_step);
        std::set<Corners> before;
        for (std::size_t i = 0; i < greedy.triangles.size(); ++i)
          before.insert(key_of(corners_of(greedy, i)));
        const GridTin tin = make(owned, bound, TinQuality::removal, 1, row_step);
        for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
          const Corners t = corners_of(tin, i);
          // Steps are rounded to 1 / 1024 of a square.
          if (smallest_angle(t, 1, row_step) < 4.98) {
            EXPECT_TRUE(gaps != Gaps::none || before.count(key_of(t)) == 1);
          }
        }
        if (gaps == Gaps::none && relief == Relief::hills) {
          EXPECT_LT(tin.triangles.size(), greedy.triangles.size());
        }
      }
    }
  }
}

TEST(GridTin, StillWaterHasFewTriangles) {
  OwnedWindow<float> owned = make_window<float>(Relief::noise, Gaps::none, 200, 200, 7);
  for (std::uint32_t y = 20; y < 180; ++y)
    for (std::uint32_t x = 20; x < 180; ++x) owned.heights[std::size_t{y} * 200 + x] = 0;
  for (const TinQuality quality : kQualities) {
    const GridTin tin = make(owned, 100, quality);
    std::size_t on_water = 0;
    for (const GridVertex& v : tin.vertices)
      on_water += v.column > 21 && v.column < 178 && v.row > 21 && v.row < 178 ? 1 : 0;
    EXPECT_LE(on_water, 4U);
  }
}

TEST(GridTin, OrientationFollowsTheGround) {
  const auto owned = make_window<float>(Relief::hills, Gaps::none, 20, 20, 3);
  for (const double x : {1.0, -1.0})
    for (const double y : {1.0, -1.0}) {
      const GridTin tin = make(owned, 5, TinQuality::removal, x, y);
      for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
        const Corners t = corners_of(tin, i);
        EXPECT_GT(static_cast<double>(turn(t[0], t[1], t[2])) * x * y, 0);
      }
    }
}

}  // namespace
