// SPDX-License-Identifier: GPL-3.0-or-later
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {
namespace {

// Large arrays are mapped memory that the system moves when it grows: here several times, past the
// sizes where that begins.
TEST(Delaunay2Growth, InsertionFromNothingGoesOn) {
  using Point = Delaunay2<std::int32_t>::Point;
  // One point per tile of 20 x 20 first, then tile by tile: short walks, small cavities.
  std::vector<Point> points;
  for (std::int32_t y = 0; y < 400; y += 20)
    for (std::int32_t x = 0; x < 400; x += 20) points.push_back({x, y});
  for (std::size_t tile = 0; tile < 400; ++tile) {
    for (std::int32_t i = 1; i < 400; ++i) {
      points.push_back({points[tile][0] + i % 20, points[tile][1] + i / 20});
    }
  }
  Delaunay2<std::int32_t> grown, built;
  grown.insert(points, {});
  built.build(points);
  EXPECT_EQ(grown.vertex_count(), points.size());
  EXPECT_EQ(grown.hash(), built.hash());
}

}  // namespace
}  // namespace terrace::tri
