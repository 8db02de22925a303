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
  std::vector<Point> points;
  for (std::int32_t y = 0; y < 700; ++y) {
    for (std::int32_t x = 0; x < 700; ++x) points.push_back({x, (x & 1) != 0 ? 699 - y : y});
  }
  Delaunay2<std::int32_t> grown, built;
  for (std::size_t i = 0; i < points.size(); i += 700) {
    grown.insert(std::span(points).subspan(i, 700), {});
  }
  built.build(points);
  EXPECT_EQ(grown.vertex_count(), points.size());
  EXPECT_EQ(grown.hash(), built.hash());
}

}  // namespace
}  // namespace terrace::tri
