// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "points.hpp"

namespace terrace::tri {
namespace {

const auto kLevel = [](VertexId) { return 0.0; };

TEST(Quality, KnownTriangles) {
  Delaunay2<double> triangulation;
  const std::vector<std::array<double, 2>> right{{0, 0}, {4, 0}, {0, 3}};
  const auto vertices = triangulation.build(right);
  const auto tilted = [&](VertexId v) { return v == vertices[2] ? 5.0 : 1.0; };
  const TriangleId only = *triangulation.all_triangles().begin();
  const TriangleQuality q = triangle_quality(triangulation, tilted, only);
  EXPECT_NEAR(q.min_angle_degrees, 36.86989764584402, 1e-12);
  EXPECT_NEAR(q.aspect, 5 / (2 * std::sqrt(3.0)), 1e-15);  // the inscribed radius is 1
  auto edges = q.edges;
  std::sort(edges.begin(), edges.end());
  EXPECT_EQ(edges, (std::array<double, 3>{3, 4, 5}));
  EXPECT_EQ(q.area, 6);
  EXPECT_DOUBLE_EQ(q.surface_area, 4 * 5 / 2.0);
  EXPECT_DOUBLE_EQ(q.volume_above, 6 * 7 / 3.0);
  EXPECT_EQ(q.volume_below, 0);
  // At half height the tip above has a quarter of the area.
  const TriangleQuality cut = triangle_quality(triangulation, tilted, only, 3);
  EXPECT_DOUBLE_EQ(cut.volume_above, 1.5 * 2 / 3);
  EXPECT_DOUBLE_EQ(cut.volume_above - cut.volume_below, 6 * (7 / 3.0 - 3));

  Delaunay2<double> equilateral;
  equilateral.build(std::vector<std::array<double, 2>>{{0, 0}, {2, 0}, {1, std::sqrt(3.0)}});
  const MeshQuality mesh = mesh_quality(equilateral, kLevel);
  EXPECT_NEAR(mesh.min_angle_degrees, 60, 1e-12);
  EXPECT_NEAR(mesh.max_aspect, 1, 1e-15);
  EXPECT_EQ(mesh.triangles, 1u);
  EXPECT_EQ(mesh.edges, 3u);
}

template <class Coord>
class QualityTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(QualityTest, Coords);

TYPED_TEST(QualityTest, GridSums) {
  Delaunay2<TypeParam> grid;
  grid.build_grid(0, 0, 2, 11, 6);
  const auto height = [&](VertexId v) { return static_cast<double>(grid.point(v)[0]) - 10; };
  const MeshQuality q = mesh_quality(grid, height, 0, 4);
  EXPECT_EQ(q.triangles, 100u);
  EXPECT_NEAR(q.min_angle_degrees, 45, 1e-12);
  EXPECT_NEAR(q.mean_min_angle_degrees, 45, 1e-12);
  EXPECT_NEAR(q.max_aspect, q.mean_aspect, 1e-12);
  EXPECT_EQ(q.edges, 10u * 6 + 11 * 5 + 50);
  EXPECT_EQ(q.min_edge, 2);
  EXPECT_DOUBLE_EQ(q.max_edge, std::sqrt(8.0));
  EXPECT_DOUBLE_EQ(q.mean_edge, (115 * 2 + 50 * std::sqrt(8.0)) / 165);
  EXPECT_EQ(q.edge_histogram, (std::vector<std::size_t>{115, 0, 0, 50}));
  EXPECT_DOUBLE_EQ(q.area, 200);
  EXPECT_DOUBLE_EQ(q.surface_area, 200 * std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(q.volume_above, 500);  // a wedge 10 long, 10 high, 10 wide
  EXPECT_DOUBLE_EQ(q.volume_below, 500);
  EXPECT_DOUBLE_EQ(mesh_quality(grid, height, -20).volume(), 4000);
}

TYPED_TEST(QualityTest, SumsAgreeWithBruteForce) {
  for (const PointSet kind : {PointSet::uniform, PointSet::seven_bits, PointSet::clusters}) {
    SCOPED_TRACE(name(kind));
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 300, 3));
    std::mt19937_64 random(1);
    std::vector<double> heights(triangulation.vertex_slots());
    for (double& h : heights) h = to_unit(random()) - 0.5;
    const MeshQuality q = mesh_quality(triangulation, heights, 0.1, 7);
    // The hull's area from its edges, the integral of height from corners, edges as pairs.
    double area = 0;
    double volume = 0;
    double above = 0;
    std::set<std::pair<VertexId, VertexId>> edges;
    for (const TriangleId t : triangulation.all_triangles()) {
      const auto v = triangulation.vertices(t);
      std::array<std::array<double, 2>, 3> at;
      for (std::size_t i = 0; i < 3; ++i) {
        edges.insert(std::minmax(v[i], v[(i + 1) % 3]));
        const auto p = triangulation.point(v[i]);
        at[i] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
      }
      const double size = ((at[1][0] - at[0][0]) * (at[2][1] - at[0][1]) -
                           (at[1][1] - at[0][1]) * (at[2][0] - at[0][0])) /
                          2;
      volume +=
          size * ((heights[slot(v[0])] + heights[slot(v[1])] + heights[slot(v[2])]) / 3 - 0.1);
      // Divides into many small pieces and evaluates each at its centre.
      constexpr int kParts = 24;
      for (int i = 0; i < kParts; ++i) {
        for (int k = 0; i + k < kParts; ++k) {
          for (const double shift : {1.0 / 3, 2.0 / 3}) {
            if (shift > 0.5 && i + k + 1 >= kParts) continue;
            const double a = (i + shift) / kParts;
            const double b = (k + shift) / kParts;
            above += size / (kParts * kParts) *
                     std::max(0.0, heights[slot(v[0])] * (1 - a - b) + heights[slot(v[1])] * a +
                                       heights[slot(v[2])] * b - 0.1);
          }
        }
      }
      area += size;
    }
    EXPECT_EQ(q.triangles, triangulation.triangle_count());
    EXPECT_EQ(q.edges, edges.size());
    EXPECT_EQ(std::accumulate(q.edge_histogram.begin(), q.edge_histogram.end(), std::size_t{0}),
              edges.size());
    EXPECT_GT(q.edge_histogram.front(), 0u);
    EXPECT_GT(q.edge_histogram.back(), 0u);
    EXPECT_NEAR(q.area, area, 1e-9 * area);
    EXPECT_NEAR(q.volume(), volume, 1e-9 * area);
    EXPECT_NEAR(q.volume_above, above, 1e-3 * area);
    EXPECT_GE(q.surface_area, q.area);
    EXPECT_GE(q.volume_below, 0);
  }
}

TYPED_TEST(QualityTest, DistancesOfPointsNotInserted) {
  Delaunay2<TypeParam> grid;
  grid.build_grid(0, 0, 10, 5, 5);
  const auto plane = [&](VertexId v) { return 2 * static_cast<double>(grid.point(v)[0]) + 7; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Point3> points{{5, 5, 17 + 3},  {40, 40, 87}, {-1, 0, 0},
                                   {12, 3, 31 - 5}, {1, 2, nan},  {20.5, 39, 48 + 5.0}};
  for (const Interpolation method : {Interpolation::linear, Interpolation::natural_neighbour}) {
    const VerticalDistances d = vertical_distances(grid, plane, points, method);
    EXPECT_EQ(d.count, 4u);
    EXPECT_EQ(d.outside, 2u);
    EXPECT_NEAR(d.max, 5, 1e-9);
    EXPECT_TRUE(d.worst == 3 || d.worst == 5);
    EXPECT_NEAR(d.mean, 13 / 4.0, 1e-9);
    EXPECT_NEAR(d.bias, 3 / 4.0, 1e-9);
    EXPECT_NEAR(d.rms, std::sqrt(59 / 4.0), 1e-9);
  }
  const VerticalDistances none = vertical_distances(grid, plane, std::vector<Point3>{});
  EXPECT_EQ(none.count, 0u);
  EXPECT_EQ(none.rms, 0);
}

TEST(Quality, HandlesEmptyHugeAndBadInput) {
  Delaunay2<double> triangulation;
  const std::vector<double> one(triangulation.vertex_slots());
  EXPECT_EQ(mesh_quality(triangulation, one).triangles, 0u);
  EXPECT_THROW(mesh_quality(triangulation, one, 0, 0), std::invalid_argument);
  EXPECT_THROW(mesh_quality(triangulation, std::vector<double>{}), std::invalid_argument);
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    Delaunay2<double> other;
    other.build(make_points<double>(kind, 100, 1));
    const MeshQuality q = mesh_quality(other, kLevel);
    EXPECT_EQ(q.triangles, other.triangle_count());
    EXPECT_EQ(std::accumulate(q.edge_histogram.begin(), q.edge_histogram.end(), std::size_t{0}),
              q.edges);
    if (q.triangles == 0) continue;
    EXPECT_GE(q.min_angle_degrees, 0);
    EXPECT_LE(q.mean_min_angle_degrees, 60 + 1e-12);
  }
}

}  // namespace
}  // namespace terrace::tri
