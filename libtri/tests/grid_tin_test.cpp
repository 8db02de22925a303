// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/grid_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

#include "grid_tin_oracle.hpp"
#include "tin/instruction_set.hpp"

namespace {

using namespace terrace::tri;
using namespace terrace::tri::grid_tin_oracle;

template <class T>
void expect_within_bounds(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed) {
  for (const Relief relief : kReliefs) {
    for (const Gaps gaps : kGapPatterns) {
      SCOPED_TRACE(describe(relief, gaps, columns, rows, seed));
      const auto owned = make_window<T>(relief, gaps, columns, rows, seed);
      const double bound = bound_for(relief);
      std::size_t before = std::numeric_limits<std::size_t>::max();
      for (const TinQuality quality : kQualities) {
        const GridTin tin = make(owned, bound, quality);
        const double largest_error = brute_force(owned, tin, gaps != Gaps::none);
        EXPECT_LE(largest_error, bound);
        EXPECT_NEAR(tin.check.max_error, largest_error, 1e-9 * bound);
        EXPECT_LE(tin.check.max_error, bound);
        EXPECT_EQ(tin.check.uncovered_inner, 0U);
        EXPECT_EQ(tin.check.nodata_covered, 0U);
        EXPECT_EQ(tin.check.inverted, 0U);
        if (gaps == Gaps::none) {
          EXPECT_LE(tin.triangles.size(), before);
        }
        before = tin.triangles.size();
      }
    }
  }
}

TEST(GridTin, WithinBoundOfEverySample) {
  expect_within_bounds<float>(37, 29, 1);
  expect_within_bounds<double>(18, 31, 3);
}

TEST(GridTin, WithinBoundInSmallWindows) {
  for (std::uint32_t columns = 2; columns <= 6; ++columns)
    for (std::uint32_t rows = 2; rows <= 6; ++rows)
      expect_within_bounds<float>(columns, rows, 100 * columns + rows);
}

TEST(GridTin, SingleLinesHaveNoTriangles) {
  const auto owned = make_window<float>(Relief::noise, Gaps::none, 1, 50, 5);
  const GridTin tin = make(owned, 1, TinQuality::removal);
  EXPECT_TRUE(tin.triangles.empty());
  EXPECT_TRUE(tin.vertices.empty());
  EXPECT_EQ(tin.check.samples, 50U);
  EXPECT_EQ(tin.check.uncovered, 50U);
}

TEST(GridTin, PlanesHaveTwoTriangles) {
  for (const Relief relief : {Relief::flat, Relief::ramp}) {
    for (const double bound : {0.0, 1e-6, 5.0}) {
      const auto owned = make_window<float>(relief, Gaps::none, 300, 200, 1);
      for (const TinQuality quality : kQualities) {
        const GridTin tin = make(owned, bound, quality);
        EXPECT_EQ(tin.triangles.size(), 2U);
        EXPECT_LE(tin.check.max_error, bound + 1e-9);
      }
    }
  }
}

TEST(GridTin, ZeroBoundKeepsAllSamplesOffPlanes) {
  const auto owned = make_window<float>(Relief::noise, Gaps::none, 40, 30, 1);
  for (const TinQuality quality : kQualities) {
    const GridTin tin = make(owned, 0, quality);
    EXPECT_LE(tin.check.max_error, 1e-9);
    EXPECT_GE(tin.vertices.size(), 1190U);
  }
}

TEST(GridTin, SameBytesOnEveryProcessor) {
  for (const Relief relief : kReliefs) {
    for (const Gaps gaps : {Gaps::none, Gaps::blobs}) {
      const auto owned = make_window<float>(relief, gaps, 75, 60, 21);
      OwnedWindow<double> wide{75, 60, {}};
      for (const float z : owned.heights) wide.heights.push_back(static_cast<double>(z) * 1.1);
      for (const TinQuality quality : {TinQuality::greedy, TinQuality::fitted}) {
        GridTinOptions options;
        options.max_error = bound_for(relief);
        options.quality = quality;
        const auto all_paths = [&](const auto& input) {
          const GridSides sides = settle_sides(input.window(), options.max_error);
          const GridTin expected =
              tin::make_grid_tin(input.window(), sides, options, terrace::base::SimdPath::portable);
          for (const terrace::base::SimdPath set :
               {terrace::base::SimdPath::avx2, terrace::base::SimdPath::avx512}) {
            if (!terrace::base::supports(set)) continue;
            const GridTin found = tin::make_grid_tin(input.window(), sides, options, set);
            EXPECT_EQ(found.vertices, expected.vertices);
            EXPECT_EQ(found.triangles, expected.triangles);
          }
        };
        all_paths(owned);
        all_paths(wide);
      }
    }
  }
}

TEST(GridTin, DoublesWithFloatValuesGiveTheSame) {
  const auto owned = make_window<float>(Relief::hills, Gaps::blobs, 80, 70, 2);
  OwnedWindow<double> wide{80, 70, {owned.heights.begin(), owned.heights.end()}};
  EXPECT_EQ(make(owned, 9, TinQuality::fitted).vertices,
            make(wide, 9, TinQuality::fitted).vertices);
}

TEST(GridTin, KeepsTheBoundWhereFloatsLackPrecision) {
  auto owned = make_window<double>(Relief::hills, Gaps::none, 60, 60, 6);
  for (double& z : owned.heights) z = z * 1e-3 + 123456.789;
  for (const TinQuality quality : kQualities) {
    const GridTin tin = make(owned, 0.01, quality);
    EXPECT_LE(tin.check.max_error, 0.01);
    EXPECT_LE(brute_force(owned, tin, false), 0.01);
  }
}

TEST(GridTin, RejectsInvalidArguments) {
  const auto owned = make_window<float>(Relief::hills, Gaps::none, 10, 8, 1);
  const GridSides sides = settle_sides(owned.window(), 1);
  GridTinOptions options;
  options.max_error = 1;
  const auto refused = [&](const GridWindow<float>& window, const GridSides& with,
                           const GridTinOptions& and_with) {
    EXPECT_THROW(grid_tin(window, with, and_with), std::invalid_argument);
  };
  refused({0, 0, {}}, sides, options);
  refused({10, 9, owned.heights}, sides, options);
  std::vector<float> line(2 * 65'536, 0.0F);
  refused({2, 65'536, line}, sides, options);
  for (const double bad : {-1.0, std::nan(""), 1e200}) {
    GridTinOptions wrong = options;
    wrong.max_error = bad;
    refused(owned.window(), sides, wrong);
  }
  for (const double bad : {0.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    GridTinOptions wrong = options;
    wrong.row_step = bad;
    refused(owned.window(), sides, wrong);
  }
  GridSides wrong = sides;
  wrong.last_row = {0, 5, 5, 9};
  refused(owned.window(), wrong, options);
  wrong.last_row = {0, 8};
  refused(owned.window(), wrong, options);
  wrong.last_row = {};
  refused(owned.window(), wrong, options);
  std::vector<double> high(4, 1e151);
  EXPECT_THROW(grid_tin<double>({2, 2, high}, {{0, 1}, {0, 1}, {0, 1}, {0, 1}}, options),
               std::invalid_argument);
  EXPECT_THROW(grid_tin_of_points(owned.window(), 3, options), std::invalid_argument);
}

}  // namespace
