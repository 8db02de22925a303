// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "grid_tin_oracle.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace {

using namespace terrace::tri;
using namespace terrace::tri::grid_tin_oracle;

TEST(GridTin, BestOfPoints) {
  const auto owned = make_window<float>(Relief::noise, Gaps::none, 40, 40, 8);
  const GridTinOptions options;
  for (const std::size_t count : {4UL, 5UL, 50UL, 400UL, 1600UL, 99999UL}) {
    const GridTin tin = grid_tin_of_points(owned.window(), count, options);
    EXPECT_EQ(tin.vertices.size(), std::min<std::size_t>(count, 1600));
    EXPECT_NEAR(brute_force(owned, tin, false), tin.check.max_error, 1e-6);
    if (count >= 1600) {
      EXPECT_EQ(tin.check.max_error, 0);
    }
  }
  // Each vertex was the worst sample of the mesh before it.
  GridTin before = grid_tin_of_points(owned.window(), 30, options);
  for (std::size_t count = 31; count < 60; ++count) {
    const GridTin tin = grid_tin_of_points(owned.window(), count, options);
    const GridVertex& v = tin.vertices.back();
    double error_at_vertex = 0;
    for (std::size_t i = 0; i < before.triangles.size(); ++i) {
      const Corners t = corners_of(before, i);
      const std::array<std::int64_t, 2> p{v.column, v.row};
      const std::int64_t w[3] = {-turn(t[1], t[2], p), -turn(t[2], t[0], p), -turn(t[0], t[1], p)};
      if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += static_cast<double>(w[k]) * before.vertices[before.triangles[i][k]].height;
      error_at_vertex = std::fabs(v.height - sum / static_cast<double>(w[0] + w[1] + w[2]));
    }
    EXPECT_NEAR(error_at_vertex, before.check.max_error, 1e-2);
    before = tin;
  }
}

TEST(GridTin, BestOfPointsCoversDataOnceThereAreEnough) {
  for (const Gaps gaps : kGapPatterns) {
    const auto owned = make_window<float>(Relief::hills, gaps, 40, 33, 8);
    SCOPED_TRACE(static_cast<int>(gaps));
    for (const std::size_t count : {4UL, 30UL, 300UL}) {
      const GridTin tin = grid_tin_of_points(owned.window(), count, {});
      EXPECT_LE(tin.vertices.size(), count);
      EXPECT_EQ(tin.check.nodata_covered, 0U);
    }
    const GridTin all = grid_tin_of_points(owned.window(), 40 * 33, {});
    EXPECT_EQ(all.check.uncovered_inner, 0U);
    EXPECT_LE(all.check.max_error, 1e-9);
  }
}

}  // namespace
