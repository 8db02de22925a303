// SPDX-License-Identifier: Apache-2.0
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {
namespace {

// Large arrays are mapped memory that the system moves when they grow. The tests grow them several
// times beyond the size at which this begins.
TEST(Delaunay2Growth, InsertsWhileArraysGrow) {
  using Point = Delaunay2<std::int32_t>::Point;
  // Inserts one point per tile of 20 x 20 first, then tile by tile, so that walks are short and
  // cavities small.
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

// Removes sets so large that their scratch memory is released, one hole, holes that are too long to
// be filled and are given up after everything has been flooded, and a small set after these.
TEST(Delaunay2Growth, RemovingLargeSetsKeepsTheRest) {
  constexpr std::int32_t kSide = 300;
  Delaunay2<std::int32_t> triangulation;
  const VertexId first = triangulation.build_grid(0, 0, 1, kSide, kSide);
  const std::uint64_t full_hash = triangulation.hash();
  const auto in_square = [](std::int32_t x, std::int32_t y) {
    return x >= 5 && y >= 5 && x < kSide - 5 && y < kSide - 5;
  };
  const auto in_lattice = [](std::int32_t x, std::int32_t y) { return x % 3 == 1 && y % 3 == 1; };
  const auto in_corner = [](std::int32_t x, std::int32_t y) { return x < 7 && y < 7; };
  const auto check = [&](auto member) {
    std::vector<VertexId> set;
    std::vector<Delaunay2<std::int32_t>::Point> removed, kept;
    for (const VertexId v : triangulation.all_vertices()) {
      const auto p = triangulation.point(v);
      (member(p[0], p[1]) ? removed : kept).push_back(p);
      if (member(p[0], p[1])) set.push_back(v);
    }
    triangulation.remove(set);
    EXPECT_EQ(find_fault(triangulation), "");
    Delaunay2<std::int32_t> remaining;
    remaining.build(kept);
    EXPECT_EQ(triangulation.hash(), remaining.hash());
    triangulation.insert(removed, {});
    EXPECT_EQ(find_fault(triangulation), "");
    EXPECT_EQ(triangulation.hash(), full_hash);
  };
  ASSERT_TRUE(triangulation.alive(first));
  check(in_square);
  check(in_lattice);
  check(in_corner);
}

}  // namespace
}  // namespace terrace::tri
