// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/grid_tin.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "grid_windows.hpp"
#include "tin/grid_make.hpp"

namespace {

using namespace terrace::tri;

__extension__ typedef __int128 Int128;
using Corners = std::array<std::array<std::int64_t, 2>, 3>;

constexpr TinQuality kQualities[] = {TinQuality::kGreedy, TinQuality::kRemoval,
                                     TinQuality::kFitted};

std::int64_t turn(const std::array<std::int64_t, 2>& a, const std::array<std::int64_t, 2>& b,
                  const std::array<std::int64_t, 2>& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Corners with columns to the right and rows upwards.
Corners corners_of(const GridTin& tin, std::size_t i) {
  Corners result;
  for (std::size_t k = 0; k < 3; ++k) {
    const GridVertex& v = tin.vertices[tin.triangles[i][k]];
    result[k] = {v.column, v.row};
  }
  return result;
}

/// Sorted, so that equal triangles are equal.
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

/// Every sample against every triangle, positions in integers. Returns the greatest error.
template <class T>
double brute_force(const OwnedWindow<T>& owned, const GridTin& tin, bool gaps) {
  double most = 0;
  std::int64_t area = 0;
  std::vector<bool> covered(owned.heights.size());
  for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
    Corners t = corners_of(tin, i);
    std::array<long double, 3> z{};
    for (std::size_t k = 0; k < 3; ++k) z[k] = tin.vertices[tin.triangles[i][k]].height;
    // Rows grow southward unless said otherwise: clockwise on the lattice.
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
        // Relative to the sample, so that nothing is lost where heights are equal.
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
        const double most = brute_force(owned, tin, gaps != Gaps::kNone);
        EXPECT_LE(most, bound);
        EXPECT_NEAR(tin.check.max_error, most, 1e-9 * bound);
        EXPECT_LE(tin.check.max_error, bound);
        EXPECT_EQ(tin.check.uncovered_inner, 0U);
        EXPECT_EQ(tin.check.nodata_covered, 0U);
        EXPECT_EQ(tin.check.turned, 0U);
        if (gaps == Gaps::kNone) {
          EXPECT_LE(tin.triangles.size(), before);
        }
        before = tin.triangles.size();
      }
    }
  }
}

TEST(GridTin, WithinBoundOfEverySample) {
  expect_within_bounds<float>(37, 29, 1);
  expect_within_bounds<float>(18, 41, 2);
  expect_within_bounds<double>(37, 29, 3);
}

TEST(GridTin, WithinBoundInSmallWindows) {
  for (std::uint32_t columns = 2; columns <= 6; ++columns)
    for (std::uint32_t rows = 2; rows <= 6; ++rows)
      expect_within_bounds<float>(columns, rows, 100 * columns + rows);
}

TEST(GridTin, NoTrianglesOnALine) {
  const auto owned = make_window<float>(Relief::kNoise, Gaps::kNone, 1, 50, 5);
  const GridTin tin = make(owned, 1, TinQuality::kRemoval);
  EXPECT_TRUE(tin.triangles.empty());
  EXPECT_TRUE(tin.vertices.empty());
  EXPECT_EQ(tin.check.samples, 50U);
  EXPECT_EQ(tin.check.uncovered, 50U);
}

TEST(GridTin, FlatAndRampAreTwoTriangles) {
  for (const Relief relief : {Relief::kFlat, Relief::kRamp}) {
    for (const double bound : {0.0, 1e-6, 5.0}) {
      const auto owned = make_window<float>(relief, Gaps::kNone, 300, 200, 1);
      for (const TinQuality quality : kQualities) {
        const GridTin tin = make(owned, bound, quality);
        EXPECT_EQ(tin.triangles.size(), 2U);
        EXPECT_LE(tin.check.max_error, bound + 1e-9);
      }
    }
  }
}

TEST(GridTin, BoundOfNothingKeepsAllThatIsNotPlane) {
  const auto owned = make_window<float>(Relief::kNoise, Gaps::kNone, 40, 30, 1);
  for (const TinQuality quality : kQualities) {
    const GridTin tin = make(owned, 0, quality);
    EXPECT_LE(tin.check.max_error, 1e-9);
    EXPECT_GE(tin.vertices.size(), 1190U);
  }
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
    for (const Relief relief : {Relief::kHills, Relief::kNoise, Relief::kLake, Relief::kSteps}) {
      SCOPED_TRACE(describe(relief, Gaps::kNone, 45, 38, 9));
      const auto owned = make_window<float>(relief, Gaps::kNone, 45, 38, 9);
      const GridTin tin = make(owned, bound_for(relief), TinQuality::kGreedy, steps.x, steps.y);
      for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
        const Corners t = corners_of(tin, i);
        for (const GridVertex& v : tin.vertices)
          ASSERT_FALSE(in_circle(t[0], t[2], t[1], {v.column, v.row}, steps.wx, steps.wy));
      }
    }
  }
}

TEST(GridTin, RemovalMakesNoThinTriangles) {
  for (const double row_step : {-1.0, -0.6, -2.5}) {
    for (const Relief relief : {Relief::kHills, Relief::kNoise, Relief::kLake, Relief::kFlat}) {
      for (const Gaps gaps : {Gaps::kNone, Gaps::kBlobs}) {
        SCOPED_TRACE(describe(relief, gaps, 90, 80, 4));
        const auto owned = make_window<float>(relief, gaps, 90, 80, 4);
        const double bound = bound_for(relief);
        const GridTin greedy = make(owned, bound, TinQuality::kGreedy, 1, row_step);
        std::set<Corners> before;
        for (std::size_t i = 0; i < greedy.triangles.size(); ++i)
          before.insert(key_of(corners_of(greedy, i)));
        const GridTin tin = make(owned, bound, TinQuality::kRemoval, 1, row_step);
        for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
          const Corners t = corners_of(tin, i);
          // Steps are rounded to 1 / 1024 of a square.
          if (smallest_angle(t, 1, row_step) < 4.98) {
            EXPECT_TRUE(gaps != Gaps::kNone || before.count(key_of(t)) == 1);
          }
        }
        if (gaps == Gaps::kNone && relief == Relief::kHills) {
          EXPECT_LT(tin.triangles.size(), greedy.triangles.size());
        }
      }
    }
  }
}

TEST(GridTin, StillWaterHasFewTriangles) {
  OwnedWindow<float> owned = make_window<float>(Relief::kNoise, Gaps::kNone, 200, 200, 7);
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

TEST(GridTin, OrientationIsThatOfTheGround) {
  const auto owned = make_window<float>(Relief::kHills, Gaps::kNone, 20, 20, 3);
  for (const double x : {1.0, -1.0})
    for (const double y : {1.0, -1.0}) {
      const GridTin tin = make(owned, 5, TinQuality::kRemoval, x, y);
      for (std::size_t i = 0; i < tin.triangles.size(); ++i) {
        const Corners t = corners_of(tin, i);
        EXPECT_GT(static_cast<double>(turn(t[0], t[1], t[2])) * x * y, 0);
      }
    }
}

/// Windows of a raster that share sides, each settled with the lines beside.
TEST(GridTin, WindowsFitTogether) {
  for (const Gaps gaps : kGapPatterns) {
    for (const Relief relief : {Relief::kHills, Relief::kNoise}) {
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
          // No vertex on a side but the settled ones.
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

TEST(GridTin, SameBytesOnEveryProcessor) {
  for (const Relief relief : kReliefs) {
    for (const Gaps gaps : {Gaps::kNone, Gaps::kBlobs}) {
      const auto owned = make_window<float>(relief, gaps, 150, 120, 21);
      OwnedWindow<double> wide{150, 120, {}};
      for (const float z : owned.heights) wide.heights.push_back(static_cast<double>(z) * 1.1);
      for (const TinQuality quality : {TinQuality::kGreedy, TinQuality::kFitted}) {
        GridTinOptions options;
        options.max_error = bound_for(relief);
        options.quality = quality;
        const auto all_paths = [&](const auto& any) {
          const GridSides sides = settle_sides(any.window(), options.max_error);
          const GridTin expected =
              tin::make_grid_tin(any.window(), sides, options, tin::GridPath::kPortable);
          for (const tin::GridPath path : {tin::GridPath::kAvx2, tin::GridPath::kAvx512}) {
            if (!tin::supported(path)) continue;
            const GridTin found = tin::make_grid_tin(any.window(), sides, options, path);
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

TEST(GridTin, DoublesThatAreFloatsGiveTheSame) {
  const auto owned = make_window<float>(Relief::kHills, Gaps::kBlobs, 80, 70, 2);
  OwnedWindow<double> wide{80, 70, {owned.heights.begin(), owned.heights.end()}};
  EXPECT_EQ(make(owned, 9, TinQuality::kFitted).vertices,
            make(wide, 9, TinQuality::kFitted).vertices);
}

TEST(GridTin, ShiftOfHeightsThatFloatsCannotHold) {
  auto owned = make_window<double>(Relief::kHills, Gaps::kNone, 60, 60, 6);
  for (double& z : owned.heights) z = z * 1e-3 + 123456.789;
  for (const TinQuality quality : kQualities) {
    const GridTin tin = make(owned, 0.01, quality);
    EXPECT_LE(tin.check.max_error, 0.01);
    EXPECT_LE(brute_force(owned, tin, false), 0.01);
  }
}

TEST(GridTin, BestOfPoints) {
  const auto owned = make_window<float>(Relief::kNoise, Gaps::kNone, 40, 40, 8);
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
    double there = 0;
    for (std::size_t i = 0; i < before.triangles.size(); ++i) {
      const Corners t = corners_of(before, i);
      const std::array<std::int64_t, 2> p{v.column, v.row};
      const std::int64_t w[3] = {-turn(t[1], t[2], p), -turn(t[2], t[0], p), -turn(t[0], t[1], p)};
      if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += static_cast<double>(w[k]) * before.vertices[before.triangles[i][k]].height;
      there = std::fabs(v.height - sum / static_cast<double>(w[0] + w[1] + w[2]));
    }
    EXPECT_NEAR(there, before.check.max_error, 1e-2);
    before = tin;
  }
}

TEST(GridTin, BestOfPointsWithGapsCoversOnceThereAreEnough) {
  for (const Gaps gaps : kGapPatterns) {
    const auto owned = make_window<float>(Relief::kHills, gaps, 40, 33, 8);
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

TEST(GridTin, MisuseIsRefused) {
  const auto owned = make_window<float>(Relief::kHills, Gaps::kNone, 10, 8, 1);
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
