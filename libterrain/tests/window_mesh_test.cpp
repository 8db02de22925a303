// SPDX-License-Identifier: Apache-2.0
#include "surface/window_mesh.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "surface/bounded/lattice_plan.hpp"
#include "surface/window_sides.hpp"

namespace terrace::terrain {
namespace {

/// A window of a strip of squares: the square from `i` to `i` + 1, two triangles. Vertices are
/// numbers; those of the strip are 2 * column + row.
WindowMesh<int> square(int i) {
  WindowMesh<int> mesh;
  mesh.vertices = {2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  for (std::uint32_t k = 0; k < 4; ++k) {
    const auto column = static_cast<std::size_t>(i) + k / 2;
    mesh.shared.push_back({k, static_cast<std::uint64_t>(mesh.vertices[k]), column});
  }
  return mesh;
}

struct Joined {
  std::vector<int> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Joined join_squares(int count, unsigned threads) {
  Joined joined;
  mesh_windows(
      static_cast<std::size_t>(count), threads, [] {},
      [](unsigned, std::size_t i) { return square(static_cast<int>(i)); },
      [&](std::size_t, const WindowMesh<int>& mesh) {
        joined.vertices.insert(joined.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
        joined.triangles.insert(joined.triangles.end(), mesh.triangles.begin(),
                                mesh.triangles.end());
      });
  return joined;
}

TEST(WindowMesh, SharedVerticesAreOneVertex) {
  // Enough squares that the joiner forgets vertices on the way.
  constexpr int kSquares = 10000;
  for (const unsigned threads : {1U, 3U}) {
    const Joined joined = join_squares(kSquares, threads);
    ASSERT_EQ(joined.vertices.size(), 2U * kSquares + 2);
    ASSERT_EQ(joined.triangles.size(), 2U * kSquares);
    for (std::size_t i = 0; i < joined.vertices.size(); ++i) {
      ASSERT_EQ(joined.vertices[i], static_cast<int>(i));
    }
    for (std::uint32_t i = 0; i < kSquares; ++i) {
      const std::uint32_t a = 2 * i;
      ASSERT_EQ(joined.triangles[a], (std::array{a, a + 2, a + 1}));
      ASSERT_EQ(joined.triangles[a + 1], (std::array{a + 1, a + 2, a + 3}));
    }
  }
}

TEST(WindowMesh, VerticesThatAreNotSharedStayApart) {
  WindowJoiner joiner;
  WindowMesh<int> first{{5, 6, 7}, {{1, 40}}, {{0, 1, 2}}};
  joiner.join(0, first);
  EXPECT_EQ(first.vertices, (std::vector{5, 6, 7}));
  // Only the last vertex is known, so the others follow the three of the first window.
  WindowMesh<int> second{{5, 7, 6}, {{2, 40}}, {{0, 1, 2}}};
  joiner.join(1, second);
  EXPECT_EQ(second.vertices, (std::vector{5, 7}));
  EXPECT_EQ(second.triangles.front(), (std::array{3U, 4U, 1U}));
}

TEST(WindowMesh, StopsBeforeTheNextWindow) {
  int made = 0, taken = 0;
  const auto check = [&] {
    if (made == 3) throw std::runtime_error("stopped");
  };
  EXPECT_THROW(mesh_windows(
                   10, 1, check,
                   [&](unsigned, std::size_t i) {
                     ++made;
                     return square(static_cast<int>(i));
                   },
                   [&](std::size_t, const WindowMesh<int>&) { ++taken; }),
               std::runtime_error);
  EXPECT_EQ(made, 3);
  EXPECT_EQ(taken, 3);
}

TEST(WindowMesh, EndsAfterTheWindowThatIsEnough) {
  for (const unsigned threads : {1U, 3U}) {
    std::size_t taken = 0;
    mesh_windows(
        100, threads, [] {}, [](unsigned, std::size_t i) { return square(static_cast<int>(i)); },
        [&](std::size_t i, const WindowMesh<int>&) {
          EXPECT_EQ(i, taken++);
          return i < 3;
        });
    EXPECT_EQ(taken, 4U);
  }
}

TEST(LatticePlan, CountsTheWindowsOfASample) {
  const LatticeWindow whole{3, 5, 40, 23};
  for (const std::int64_t cells : {1, 7, 100}) {
    const LatticePlan plan(whole, cells);
    std::map<std::uint64_t, std::vector<std::size_t>> windows;
    for (const bool counted : {false, true}) {
      for (std::size_t i = 0; i < plan.size(); ++i) {
        const LatticeWindow window = plan.window(i);
        for (std::int64_t row = 0; row < window.rows; ++row) {
          for (std::int64_t column = 0; column < window.columns; ++column) {
            const LatticePlan::Sample sample = plan.sample(i, column, row);
            std::vector<std::size_t>& known = windows[sample.place];
            if (!counted) {
              known.push_back(i);
            } else {
              ASSERT_EQ(sample.windows, known.size());
              ASSERT_EQ(sample.last, known.back());
            }
          }
        }
      }
    }
    EXPECT_EQ(windows.size(), whole.size());
    EXPECT_EQ(windows.rbegin()->first + 1, whole.size());
  }
}

TEST(WindowSides, ComputeEachSideOnce) {
  WindowSides<int> sides;
  int settled = 0;
  const auto settle = [&] {
    ++settled;
    return SideVertices{{0.0, 1.0}, {2.0, 3.0}};
  };
  const std::shared_ptr<const SideVertices> first = sides.vertices(7, settle);
  EXPECT_EQ(sides.vertices(7, settle), first);
  EXPECT_EQ(sides.find(7), first);
  EXPECT_EQ(settled, 1);
  sides.drop(7);
  EXPECT_EQ(sides.find(7), nullptr);
  EXPECT_EQ(first->size(), 2U);
  sides.vertices(7, settle);
  EXPECT_EQ(settled, 2);
  sides.clear();
  EXPECT_EQ(sides.find(7), nullptr);
}

TEST(WindowSides, DropTheOldest) {
  WindowSides<int> sides(std::size_t{1} << 16);
  for (int side = 0; side < 2000; ++side) {
    sides.vertices(side, [] { return SideVertices(1000); });
  }
  EXPECT_TRUE(sides.find(1999));
  EXPECT_TRUE(sides.find(1950));
  EXPECT_FALSE(sides.find(0));
}

}  // namespace
}  // namespace terrace::terrain
