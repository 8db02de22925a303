// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "grid_tin_oracle.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace {

using namespace terrace::tri;
using namespace terrace::tri::grid_tin_oracle;

/// Windows of a raster that share sides, each settled with the adjacent lines.
TEST(GridTin, WindowsFitTogether) {
  for (const Gaps gaps : kGapPatterns) {
    for (const Relief relief : {Relief::hills, Relief::noise}) {
      constexpr std::uint32_t kSize = 61, kHalf = 30;
      SCOPED_TRACE(describe(relief, gaps, kSize, kSize, 11));
      const auto whole = make_window<float>(relief, gaps, kSize, kSize, 11);
      const double bound = bound_for(relief);
      const auto line = [&](bool row, std::uint32_t at, std::uint32_t from, std::uint32_t to) {
        std::vector<float> result;
        if (at < kSize)
          for (std::uint32_t i = from; i <= to; ++i)
            result.push_back(row ? whole.at(i, at) : whole.at(at, i));
        return result;
      };
      const auto settle = [&](bool row, std::uint32_t at, std::uint32_t from, std::uint32_t to) {
        return settle_side<float>(line(row, at, from, to), line(row, at - 1, from, to),
                                  line(row, at + 1, from, to), bound);
      };
      std::vector<bool> covered(kSize * kSize);
      for (const std::uint32_t y0 : {0U, kHalf}) {
        for (const std::uint32_t x0 : {0U, kHalf}) {
          OwnedWindow<float> part{kHalf + 1, kHalf + 1, {}};
          for (std::uint32_t y = 0; y <= kHalf; ++y)
            for (std::uint32_t x = 0; x <= kHalf; ++x)
              part.heights.push_back(whole.at(x0 + x, y0 + y));
          const GridSides sides{
              settle(true, y0, x0, x0 + kHalf), settle(true, y0 + kHalf, x0, x0 + kHalf),
              settle(false, x0, y0, y0 + kHalf), settle(false, x0 + kHalf, y0, y0 + kHalf)};
          GridTinOptions options;
          options.max_error = bound;
          const GridTin tin = grid_tin(part.window(), sides, options);
          EXPECT_LE(tin.check.max_error, bound);
          EXPECT_EQ(tin.check.uncovered_inner, 0U);
          EXPECT_EQ(tin.check.nodata_covered, 0U);
          // The only vertices on a side are the settled ones.
          for (const GridVertex& v : tin.vertices) {
            const auto on = [](const std::vector<std::uint32_t>& side, std::uint32_t at) {
              return std::binary_search(side.begin(), side.end(), at);
            };
            if (v.row == 0) {
              EXPECT_TRUE(on(sides.first_row, v.column));
            }
            if (v.row == kHalf) {
              EXPECT_TRUE(on(sides.last_row, v.column));
            }
            if (v.column == 0) {
              EXPECT_TRUE(on(sides.first_column, v.row));
            }
            if (v.column == kHalf) {
              EXPECT_TRUE(on(sides.last_column, v.row));
            }
          }
        }
      }
    }
  }
}

}  // namespace
