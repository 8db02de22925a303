// SPDX-License-Identifier: Apache-2.0
#include "mesh/height_grid.hpp"

#include <set>

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

TEST(HeightGrid, KeepsCellsThatFit) {
  HeightGrid grid(4, 3, 100);
  EXPECT_EQ(grid.reduction(), 1u);
  for (int i = 0; i < 12; ++i) grid.add({i % 4 + 0.0, i / 4 + 0.0, i * 1.0});
  const TriangleMesh mesh = grid.mesh();
  ASSERT_EQ(mesh.positions.size(), 12u);
  EXPECT_EQ(mesh.positions[5], (stream::Point3{1, 1, 5}));
  EXPECT_EQ(mesh.triangles.size(), 2u * 3 * 2);
}

TEST(HeightGrid, AveragesSquares) {
  HeightGrid grid(5, 4, 6);
  EXPECT_EQ(grid.reduction(), 2u);
  for (int i = 0; i < 20; ++i) grid.add({i % 5 + 0.0, i / 5 + 0.0, i * 1.0});
  const TriangleMesh mesh = grid.mesh();
  ASSERT_EQ(mesh.positions.size(), 6u);
  EXPECT_EQ(mesh.positions[0], (stream::Point3{0.5, 0.5, (0 + 1 + 5 + 6) / 4.0}));
  EXPECT_EQ(mesh.positions[2][2], (4 + 9) / 2.0);  // the last column has no partner
}

TEST(HeightGrid, StopsWhenRequested) {
  struct Stop {};
  constexpr std::uint64_t kSide = 1000;
  std::size_t calls = 0, last = 0;
  const auto check_stop = [&] {
    if (++calls == last) throw Stop();
  };
  HeightGrid grid(kSide, kSide, kSide * kSide, check_stop);
  EXPECT_GE(calls, 3U);
  for (std::uint64_t i = 0; i < kSide * kSide; ++i) {
    grid.add({static_cast<double>(i % kSide), static_cast<double>(i / kSide), 0.0});
  }
  calls = 0;
  static_cast<void>(grid.mesh());
  last = calls;
  EXPECT_GE(last, 100U);
  calls = 0;
  EXPECT_THROW(static_cast<void>(grid.mesh()), Stop);
  EXPECT_EQ(calls, last);
}

TEST(HeightGrid, LeavesHolesWithoutData) {
  HeightGrid grid(3, 3, 100);
  for (int i = 0; i < 9; ++i) {
    if (i != 4 && i != 0) grid.add({i % 3 + 0.0, i / 3 + 0.0, 0});
  }
  const TriangleMesh mesh = grid.mesh();
  EXPECT_EQ(mesh.positions.size(), 7u);
  // Every square touches the missing middle: three keep one triangle, the one that lacks another
  // corner keeps none.
  EXPECT_EQ(mesh.triangles.size(), 3u);
  for (const auto& t : mesh.triangles) {
    EXPECT_EQ((std::set<std::uint32_t>(t.begin(), t.end()).size()), 3u);
  }
}

TEST(HeightGrid, IgnoresCellsOutside) {
  HeightGrid grid(2, 2, 100);
  grid.add({-1, 0, 5});
  grid.add({0, 2, 5});
  EXPECT_TRUE(grid.mesh().positions.empty());
}

}  // namespace
}  // namespace terrace::terrain
