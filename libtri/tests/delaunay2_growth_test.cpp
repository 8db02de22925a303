// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {
namespace {

// Large arrays are mapped memory that the system moves when it grows: here several times, past the
// sizes where that begins.
TEST(Delaunay2Growth, InsertionFromNothingGoesOn) {
  using Point = Delaunay2<std::int32_t>::Point;
  std::vector<Point> points;
  for (std::int32_t y = 0; y < 400; ++y) {
    for (std::int32_t x = 0; x < 400; ++x) points.push_back({x, y});
  }
  std::mt19937_64 random(1);
  for (std::size_t i = points.size(); i > 1; --i) std::swap(points[i - 1], points[random() % i]);
  Delaunay2<std::int32_t> grown, built;
  grown.insert(points, {});
  built.build(points);
  EXPECT_EQ(grown.vertex_count(), points.size());
  EXPECT_EQ(grown.hash(), built.hash());
}

}  // namespace
}  // namespace terrace::tri
