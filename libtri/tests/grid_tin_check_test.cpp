// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

#include "grid_windows.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "tin/instruction_set.hpp"

namespace {

using namespace terrace::tri;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

const std::vector<Point3> kSquare{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}};
const Triangles kHalves{{0, 1, 2}, {0, 2, 3}};

TEST(GridTinCheck, FindsErrorsEverywhere) {
  for (std::size_t at = 0; at < 16; ++at) {
    std::vector<double> heights(16, 0.0);
    heights[at] = -7;
    const GridTinCheck check = check_grid_tin<double>({4, 4, heights}, kSquare, kHalves);
    EXPECT_EQ(check.max_error, 7);
    EXPECT_NEAR(check.rms_error, 7.0 / 4, 1e-12);
    EXPECT_EQ(check.covered, 16U);
    EXPECT_EQ(check.inverted, 0U);
  }
}

TEST(GridTinCheck, CountsUncoveredSamples) {
  std::vector<double> heights(16, 1.0);
  GridTinCheck check = check_grid_tin<double>({4, 4, heights}, kSquare, Triangles{{0, 1, 2}});
  EXPECT_EQ(check.samples, 16U);
  EXPECT_EQ(check.covered, 10U);
  EXPECT_EQ(check.uncovered, 6U);
  EXPECT_EQ(check.uncovered_inner, 6U);
  EXPECT_EQ(check.max_error, 1);
  heights[12] = kNoHeight;  // column 0, row 3, so that its 3 neighbours are not inner
  check = check_grid_tin<double>({4, 4, heights}, kSquare, Triangles{{0, 1, 2}});
  EXPECT_EQ(check.samples, 15U);
  EXPECT_EQ(check.uncovered, 5U);
  EXPECT_EQ(check.uncovered_inner, 2U);
  EXPECT_EQ(check.nodata_covered, 0U);
  check = check_grid_tin<double>({4, 4, heights}, kSquare, kHalves);
  EXPECT_EQ(check.nodata_covered, 1U);
  EXPECT_EQ(check.uncovered, 0U);
}

TEST(GridTinCheck, CountsInvertedTriangles) {
  const std::vector<double> heights(16, 0.0);
  EXPECT_EQ(
      check_grid_tin<double>({4, 4, heights}, kSquare, Triangles{{0, 1, 2}, {0, 3, 2}}).inverted,
      1U);
  EXPECT_EQ(
      check_grid_tin<double>({4, 4, heights}, kSquare, Triangles{{0, 1, 2}, {0, 0, 2}}).inverted,
      1U);
}

TEST(GridTinCheck, AcceptsCornersOffTheLattice) {
  std::vector<double> heights;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) heights.push_back(2 * x - 3 * y);
  std::vector<Point3> moved;
  for (const auto& [x, y, z] : kSquare) {
    const double u = x == 0 ? x + 0.001 : x - 0.001, v = y == 0 ? y + 0.001 : y - 0.001;
    moved.push_back({u, v, 2 * u - 3 * v});
  }
  GridTinCheck check = check_grid_tin<double>({4, 4, heights}, moved, kHalves);
  EXPECT_EQ(check.covered, 4U);
  check = check_grid_tin<double>({4, 4, heights}, moved, kHalves, 0.002);
  EXPECT_EQ(check.covered, 16U);
  EXPECT_LE(check.max_error, 1e-12);
  // A sample without data is covered only if it is strictly inside.
  heights[0] = kNoHeight;
  EXPECT_EQ(check_grid_tin<double>({4, 4, heights}, moved, kHalves, 0.002).nodata_covered, 0U);
  heights[5] = kNoHeight;
  EXPECT_EQ(check_grid_tin<double>({4, 4, heights}, moved, kHalves, 0.002).nodata_covered, 1U);
}

/// A window of relief, with gaps for even seeds, and triangles across it that overlap each other
/// and its sides.
struct CrossingTriangles {
  OwnedWindow<float> owned;
  std::vector<Point3> points;
  Triangles triangles;
};

CrossingTriangles make_crossing_triangles(std::uint32_t columns, std::uint32_t rows,
                                          std::uint64_t seed) {
  CrossingTriangles result{
      make_window<float>(Relief::noise, seed % 2 == 0 ? Gaps::blobs : Gaps::none, columns, rows,
                         seed),
      {},
      {}};
  std::mt19937_64 random(seed);
  const auto coordinate = [&](std::uint32_t count) {
    return static_cast<double>(random() % (64 * (count + 3))) / 64 - 1.5;
  };
  for (int i = 0; i < 12; ++i)
    result.points.push_back(
        {coordinate(columns), coordinate(rows), static_cast<double>(random() % 1000)});
  for (std::uint32_t i = 0; i + 2 < 12; ++i) result.triangles.push_back({i, i + 1, i + 2});
  return result;
}

void compare_with_all(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(columns) + " columns");
  const auto [owned, points, triangles] = make_crossing_triangles(columns, rows, seed);
  double expected_error = 0;
  std::size_t covered = 0, missing = 0;
  for (std::uint32_t y = 0; y < rows; ++y) {
    for (std::uint32_t x = 0; x < columns; ++x) {
      bool in_any = false;
      const double z = static_cast<double>(owned.at(x, y));
      for (const auto& t : triangles) {
        const Point3 &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
        const auto area = [&](const Point3& p, const Point3& q, double u, double v) {
          return (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]);
        };
        double w[3] = {area(b, c, x, y), area(c, a, x, y), area(a, b, x, y)};
        const double sum = w[0] + w[1] + w[2];
        if (sum == 0 || w[0] / sum < 0 || w[1] / sum < 0 || w[2] / sum < 0) continue;
        in_any = true;
        const double plane = (w[0] * a[2] + w[1] * b[2] + w[2] * c[2]) / sum;
        if (std::isfinite(z)) expected_error = std::max(expected_error, std::fabs(plane - z));
      }
      covered += in_any && std::isfinite(z) ? 1 : 0;
      missing += in_any && !std::isfinite(z) ? 1 : 0;
    }
  }
  const GridTinCheck check = check_grid_tin<float>(owned.window(), points, triangles);
  EXPECT_NEAR(check.max_error, expected_error, 1e-6 * (1 + expected_error));
  EXPECT_EQ(check.covered, covered);
  EXPECT_EQ(check.nodata_covered, missing);
}

TEST(GridTinCheck, AgreesWithBruteForce) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    compare_with_all(12, 9, seed);
    compare_with_all(3, 40, seed);
    compare_with_all(61, 35, seed);
    compare_with_all(130, 17, seed);
  }
}

template <class T>
void expect_same_on_every_processor(const GridWindow<T>& window, const CrossingTriangles& input) {
  for (const double tolerance : {0.0, 0.3}) {
    const GridTinCheck expected = tin::check_grid_tin_with(
        window, input.points, input.triangles, tolerance, terrace::base::SimdPath::portable);
    EXPECT_GT(expected.covered, 0U);
    for (const terrace::base::SimdPath set :
         {terrace::base::SimdPath::avx2, terrace::base::SimdPath::avx512}) {
      if (!terrace::base::supports(set)) continue;
      const GridTinCheck check =
          tin::check_grid_tin_with(window, input.points, input.triangles, tolerance, set);
      EXPECT_EQ(check.max_error, expected.max_error);
      EXPECT_EQ(check.rms_error, expected.rms_error);
      EXPECT_EQ(check.covered, expected.covered);
      EXPECT_EQ(check.uncovered_inner, expected.uncovered_inner);
      EXPECT_EQ(check.nodata_covered, expected.nodata_covered);
    }
  }
}

TEST(GridTinCheck, SameBitsOnEveryProcessor) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const CrossingTriangles input = make_crossing_triangles(seed % 3 == 0 ? 11 : 150, 33, seed);
    expect_same_on_every_processor(input.owned.window(), input);
    const std::vector<double> heights(input.owned.heights.begin(), input.owned.heights.end());
    expect_same_on_every_processor<double>({input.owned.columns, input.owned.rows, heights}, input);
  }
}

TEST(GridTinCheck, RejectsInvalidArguments) {
  const std::vector<double> heights(16, 0.0);
  const GridWindow<double> window{4, 4, heights};
  EXPECT_THROW(check_grid_tin<double>({4, 5, heights}, kSquare, kHalves), std::invalid_argument);
  EXPECT_THROW(check_grid_tin<double>(window, kSquare, Triangles{{0, 1, 4}}),
               std::invalid_argument);
  EXPECT_THROW(check_grid_tin<double>(window, kSquare, kHalves, 2), std::invalid_argument);
  EXPECT_THROW(check_grid_tin<double>(window, kSquare, kHalves, kNoHeight), std::invalid_argument);
  for (const double bad : {kNoHeight, 1e30, std::numeric_limits<double>::infinity()}) {
    std::vector<Point3> points = kSquare;
    points[2][1] = bad;
    EXPECT_THROW(check_grid_tin<double>(window, points, kHalves), std::invalid_argument);
  }
}

// The tests of all instruction sets skip those that the machine lacks. This test reports it.
TEST(InstructionSets, Avx2IsTested) {
  if (!terrace::base::supports(terrace::base::SimdPath::avx2))
    GTEST_SKIP() << "the processor lacks AVX2";
}

TEST(InstructionSets, Avx512IsTested) {
  if (!terrace::base::supports(terrace::base::SimdPath::avx512))
    GTEST_SKIP() << "the processor lacks AVX-512";
}

}  // namespace
