// SPDX-License-Identifier: GPL-3.0-or-later
#include "ear_queue.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "points3.hpp"

namespace terrace::research {

using namespace tri;

namespace {

template <class Coord>
class EarQueueTest : public ::testing::Test {};

using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(EarQueueTest, Coords);

TYPED_TEST(EarQueueTest, RemovalEqualsThatOfTheLibrary) {
  for (const PointSet3 kind : kPointSets3) {
    SCOPED_TRACE(name(kind));
    std::mt19937_64 random(11);
    const auto points = make_points3<TypeParam>(kind, 150, 5);
    Delaunay3<TypeParam> by_ears, by_wrapping;
    std::vector<VertexId> vertices = by_ears.build(points);
    ASSERT_EQ(by_wrapping.build(points), vertices);
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::shuffle(vertices.begin(), vertices.end(), random);
    while (!vertices.empty()) {
      remove_by_ears(by_ears, vertices.back());
      by_wrapping.remove(vertices.back());
      vertices.pop_back();
      ASSERT_EQ(by_ears.vertex_count(), vertices.size());
      ASSERT_EQ(find_fault(by_ears), "");
      ASSERT_EQ(by_ears.hash(), by_wrapping.hash()) << vertices.size() << " vertices left";
    }
  }
}

TYPED_TEST(EarQueueTest, ReinsertionRestoresTheTriangulation) {
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::grid, PointSet3::sphere}) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<TypeParam>(kind, 800, 3);
    Delaunay3<TypeParam> triangulation;
    const std::vector<VertexId> vertices = triangulation.build(points);
    const std::uint64_t before = triangulation.hash();
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < vertices.size(); i += 3) {
      if (!triangulation.alive(vertices[i])) continue;
      remove_by_ears(triangulation, vertices[i]);
      chosen.push_back(i);
    }
    ASSERT_NE(triangulation.hash(), before);
    for (const std::size_t i : chosen) triangulation.insert(points[i]);
    ASSERT_EQ(find_fault(triangulation), "");
    ASSERT_EQ(triangulation.hash(), before);
  }
}

}  // namespace
}  // namespace terrace::research
