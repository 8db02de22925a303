// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/delaunay2.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "points.hpp"

namespace terrace::tri {
namespace {

template <class Coord>
class Delaunay2Test : public ::testing::Test {
 public:
  using Point = std::array<Coord, 2>;

  static std::uint64_t rebuilt_hash(const Delaunay2<Coord>& triangulation) {
    std::vector<Point> points;
    for (const VertexId v : triangulation.all_vertices()) points.push_back(triangulation.point(v));
    std::mt19937_64 random(points.size());
    std::shuffle(points.begin(), points.end(), random);
    Delaunay2<Coord> other;
    other.build(points);
    return other.hash();
  }
};

using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Delaunay2Test, Coords);

TYPED_TEST(Delaunay2Test, BuildIsValidAndCompleteForEveryKindOfPoints) {
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 4u, 7u, 40u, 3000u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points<TypeParam>(kind, count, 17 + count);
      Delaunay2<TypeParam> triangulation;
      const std::vector<VertexId> vertices = triangulation.build(points);
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(vertices.size(), points.size());
      std::set<std::array<TypeParam, 2>> different(points.begin(), points.end());
      EXPECT_EQ(triangulation.vertex_count(), different.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_TRUE(triangulation.alive(vertices[i]));
        ASSERT_EQ(triangulation.point(vertices[i]), points[i]);
      }
    }
  }
}

TYPED_TEST(Delaunay2Test, OneByOneEqualsBuild) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points<TypeParam>(kind, 500, 3);
    Delaunay2<TypeParam> built;
    const std::vector<VertexId> vertices = built.build(points);
    Delaunay2<TypeParam> inserted;
    std::map<std::array<TypeParam, 2>, VertexId> known;
    for (const auto& point : points) {
      const auto [vertex, created] = inserted.insert(point);
      ASSERT_EQ(created, known.emplace(point, vertex).second);
      ASSERT_EQ(known[point], vertex);
    }
    ASSERT_EQ(find_fault(inserted), "");
    EXPECT_EQ(inserted.hash(), built.hash());
    EXPECT_EQ(inserted.vertex_count(), built.vertex_count());
    EXPECT_EQ(inserted.triangle_count(), built.triangle_count());
  }
}

TYPED_TEST(Delaunay2Test, RemovalDownToNothingStaysValid) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 120, 5));
    std::mt19937_64 random(1);
    while (triangulation.vertex_count() > 0) {
      std::vector<VertexId> left;
      for (const VertexId v : triangulation.all_vertices()) left.push_back(v);
      triangulation.remove(left[random() % left.size()]);
      ASSERT_EQ(find_fault(triangulation), "") << triangulation.vertex_count() << " left";
      ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
    }
    EXPECT_EQ(triangulation.triangle_count(), 0u);
  }
}

TYPED_TEST(Delaunay2Test, RemovalOfSetsEqualsRebuild) {
  for (const PointSet kind : kPointSets) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points<TypeParam>(kind, 30 + random() % 600, seed);
      Delaunay2<TypeParam> triangulation;
      triangulation.build(points);
      std::vector<VertexId> vertices;
      for (const VertexId v : triangulation.all_vertices()) vertices.push_back(v);
      // Compact sets: nearest to a vertex, now and then with vertices left out (islands).
      const auto centre = triangulation.point(vertices[random() % vertices.size()]);
      const auto distance = [&](VertexId v) {
        const auto p = triangulation.point(v);
        const double x = static_cast<double>(p[0]) - static_cast<double>(centre[0]);
        const double y = static_cast<double>(p[1]) - static_cast<double>(centre[1]);
        return x * x + y * y;
      };
      std::stable_sort(vertices.begin(), vertices.end(),
                       [&](VertexId a, VertexId b) { return distance(a) < distance(b); });
      vertices.resize(random() % (vertices.size() + 1));
      const std::uint64_t keep_out = random() % 4;
      if (keep_out > 0)
        std::erase_if(vertices, [&](VertexId) { return random() % (4 << (2 * keep_out)) == 0; });
      triangulation.remove(std::span<const VertexId>(vertices));
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
    }
  }
}

}  // namespace
}  // namespace terrace::tri
