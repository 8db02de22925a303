// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "surface/bounded/point_mesh_cells.hpp"

namespace terrace::terrain {
namespace {

TEST(PointMeshCuts, FillCellsNearlyToTheLimit) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 engine(seed);
    const bool lattice = seed % 2 == 0;
    std::vector<Point2> all;
    for (int i = 0; i < 20000; ++i) {
      const double x = static_cast<double>(engine() >> 11) * 0x1p-53;
      const double y = static_cast<double>(engine() >> 11) * 0x1p-53;
      all.push_back(lattice ? Point2{std::floor(x * 150), std::floor(y * 130)}
                            : Point2{x * x * x, y});
    }
    const std::size_t most = 100 + 300 * seed;
    const PointMeshCuts cuts = cut_for_point_mesh(all, 1, most);
    std::vector<std::size_t> counts(cuts.cells.size(), 0);
    for (const Point2& p : all) {
      const std::uint32_t cell = cuts.cell_of(p);
      ASSERT_LT(cell, cuts.cells.size());
      EXPECT_TRUE(cuts.cells[cell].box.contains(p));
      ++counts[cell];
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      EXPECT_EQ(static_cast<double>(counts[i]), cuts.cells[i].samples);
      EXPECT_LE(counts[i], most);
    }
    EXPECT_LE(static_cast<double>(cuts.cells.size()),
              1.0 + 1.7 * static_cast<double>(all.size()) / static_cast<double>(most));
    // No sample is on a line.
    for (const PointMeshCuts::Node& node : cuts.nodes) {
      for (const Point2& p : all) EXPECT_NE(p[node.axis], node.line);
    }
  }
}

TEST(PointMeshCuts, CannotDivideSinglePlace) {
  std::vector<Point2> all(1000, Point2{3, 4});
  EXPECT_EQ(cut_for_point_mesh(all, 1, 100).cells.size(), 1U);
  // The other places can be separated from it.
  for (int i = 0; i < 50; ++i) all.push_back({static_cast<double>(i), 10});
  const PointMeshCuts cuts = cut_for_point_mesh(all, 1, 100);
  EXPECT_GT(cuts.cells.size(), 1U);
  EXPECT_EQ(cuts.cells[cuts.cell_of({3, 4})].low, (Point2{3, 4}));
}

TEST(NumberBetween, IsBetweenAndShort) {
  EXPECT_EQ(number_between(1.0, 2.0), 1.5);
  EXPECT_EQ(number_between(-1.0, 2.0), 0.0);
  EXPECT_EQ(number_between(1000.1, 1000.9), 1000.5);
  std::mt19937_64 engine(7);
  for (int i = 0; i < 10000; ++i) {
    const double a = (static_cast<double>(engine() >> 11) * 0x1p-53 - 0.5) *
                     std::ldexp(1.0, static_cast<int>(engine() % 200) - 100);
    const double wide = std::abs(a) * std::ldexp(1.0, static_cast<int>(engine() % 60) - 50);
    const double b = a + wide;
    if (!(a < b)) continue;
    const double c = number_between(a, b);
    if (std::nextafter(a, b) == b) {
      EXPECT_EQ(c, a);
    } else {
      EXPECT_TRUE(a < c && c < b) << a << ' ' << b << ' ' << c;
    }
  }
}

}  // namespace
}  // namespace terrace::terrain
