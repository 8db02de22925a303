// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "delaunay2/elliptical_kernel.hpp"
#include "delaunay2/predicates.hpp"
#include "metrics.hpp"
#include "points.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri::test {
namespace {

template <class Triangulation>
std::vector<Corners> corners_of_all(const Triangulation& triangulation,
                                    const std::vector<std::array<VertexId, 3>>& triangles) {
  std::vector<Corners> result;
  for (const auto& vertices : triangles) {
    const Corners t = corners_of(triangulation, vertices);
    EXPECT_EQ(static_cast<double>(triangulation.point(vertices[0])[0]), t[0][0]);
    result.push_back(t);
  }
  std::sort(result.begin(), result.end());
  return result;
}

using PlaneEdge = std::pair<PlanePoint, PlanePoint>;
/// The corner on the left of each directed edge.
std::map<PlaneEdge, PlanePoint> apices(const std::vector<Corners>& triangles) {
  std::map<PlaneEdge, PlanePoint> result;
  for (const Corners& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_TRUE(result.emplace(PlaneEdge{t[(i + 1) % 3], t[(i + 2) % 3]}, t[i]).second)
          << "an edge has two triangles on one side";
    }
  }
  return result;
}
std::set<PlaneEdge> border(const std::map<PlaneEdge, PlanePoint>& edges) {
  std::set<PlaneEdge> result;
  for (const auto& [edge, apex] : edges)
    if (!edges.contains({edge.second, edge.first})) result.insert(edge);
  return result;
}

/// Checks all guarantees. Returns the number of triangles that are not in `before`.
std::size_t check(const std::vector<Corners>& before, const std::vector<Corners>& after,
                  const MetricField2& field, const LinearMap2& given = kIdentityMap<2>) {
  // A triangulation of the same points must have positive areas, matching edges and the same
  // border, so that it covers the inside of the border once. It must also have the same corners.
  EXPECT_EQ(before.size(), after.size());
  std::set<PlanePoint> corners_before, corners_after;
  for (const Corners& t : before) corners_before.insert(t.begin(), t.end());
  for (const Corners& t : after) {
    corners_after.insert(t.begin(), t.end());
    EXPECT_GT(planar::DoubleKernel::orientation(t[0], t[1], t[2]), 0);
  }
  EXPECT_TRUE(corners_before == corners_after);
  const auto edges_before = apices(before), edges_after = apices(after);
  EXPECT_TRUE(border(edges_before) == border(edges_after));
  // Nothing may change where regions meet.
  const auto mixed = [&](const Corners& t) {
    return field(t[0]) != field(t[1]) || field(t[0]) != field(t[2]);
  };
  std::vector<Corners> mixed_before, mixed_after;
  std::copy_if(before.begin(), before.end(), std::back_inserter(mixed_before), mixed);
  std::copy_if(after.begin(), after.end(), std::back_inserter(mixed_after), mixed);
  EXPECT_TRUE(mixed_before == mixed_after);
  // Edges within regions must be Delaunay, with ties broken as in Delaunay2.
  std::map<LinearMap2, planar::QuadraticForm> forms;
  for (const auto& [edge, apex] : edges_after) {
    const auto mate = edges_after.find({edge.second, edge.first});
    const LinearMap2 map = field(apex);
    if (mate == edges_after.end() || field(edge.first) != map || field(edge.second) != map ||
        field(mate->second) != map)
      continue;
    EXPECT_LE(in_ellipse(map, apex, edge.first, edge.second, mate->second), 0);
    const auto& form = forms.try_emplace(map, map).first->second;
    const planar::EllipticalKernel::Scope scope(form);
    EXPECT_FALSE(planar::inside_circle<planar::EllipticalKernel>(apex, edge.first, edge.second,
                                                                 mate->second));
  }
  std::size_t changed = 0;
  for (const Corners& t : after) {
    if (std::binary_search(before.begin(), before.end(), t)) continue;
    ++changed;
    EXPECT_NE(field(t[0]), given) << "a triangle in the triangulation's own metric changed";
  }
  return changed;
}

template <class Coord>
class MetricTriangles : public ::testing::Test {};
using CoordTypes = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(MetricTriangles, CoordTypes);

TYPED_TEST(MetricTriangles, KeepTheGuarantees) {
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {1u, 3u, 30u, 800u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points<TypeParam>(kind, count, 41);
      Delaunay2<TypeParam> triangulation;
      triangulation.build(points);
      const MetricField2 field = three_regions(points);
      const std::size_t changed =
          check(triangles_of(triangulation),
                corners_of_all(triangulation, metric_triangles(triangulation, field)), field);
      if (kind == PointSet::uniform && count == 800) {
        EXPECT_GT(changed, 300u);
      }
      if (this->HasFailure()) return;
    }
  }
}

TYPED_TEST(MetricTriangles, DependOnThePointsAlone) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    auto points = make_points<TypeParam>(kind, 400, 42);
    const MetricField2 field = three_regions(points);
    Delaunay2<TypeParam> one;
    one.build(points);
    const auto expected = corners_of_all(one, metric_triangles(one, field));
    // Another order, and temporary points.
    std::mt19937_64 random(7);
    std::shuffle(points.begin(), points.end(), random);
    Delaunay2<TypeParam> other;
    std::vector<VertexId> guests;
    const auto other_points = make_points<TypeParam>(kind, 200, 43);
    for (std::size_t i = 0; i < other_points.size(); ++i) {
      other.insert(points[2 * i]);
      if (const auto [v, created] = other.insert(other_points[i]); created) guests.push_back(v);
    }
    other.remove(std::span<const VertexId>(guests));
    for (const auto& p : points) other.insert(p);
    ASSERT_TRUE(corners_of_all(other, metric_triangles(other, field)) == expected);
  }
}

TYPED_TEST(MetricTriangles, CoverTheSelectedTriangles) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points<TypeParam>(kind, 600, 44);
    Delaunay2<TypeParam> triangulation;
    triangulation.build(points);
    const MetricField2 field = three_regions(points);
    const auto filter = [](TriangleId id) { return slot(id) % 7 != 3; };
    std::vector<Corners> before;
    for (const TriangleId id : triangulation.all_triangles()) {
      if (filter(id)) before.push_back(corners_of(triangulation, triangulation.vertices(id)));
    }
    std::sort(before.begin(), before.end());
    check(before, corners_of_all(triangulation, metric_triangles(triangulation, field, filter)),
          field);
    if (this->HasFailure()) return;
  }
}

TYPED_TEST(MetricTriangles, OfOneMetricEqualTheEllipticalTriangulation) {
  std::vector<LinearMap2> maps = lower_maps();
  maps.push_back(ellipse_map(7, 1, 25));
  for (const PointSet kind : kPointSets) {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      SCOPED_TRACE(name(kind) + " map " + std::to_string(m));
      const auto points = make_points<TypeParam>(kind, 300, 44);
      Delaunay2<TypeParam> triangulation;
      triangulation.build(points);
      std::vector<PlanePoint> doubles;
      for (const auto& p : points)
        doubles.push_back({static_cast<double>(p[0]), static_cast<double>(p[1])});
      Elliptical2 elliptical(maps[m]);
      elliptical.build(doubles);
      const MetricField2 everywhere([&](const PlanePoint&) { return maps[m]; });
      ASSERT_TRUE(corners_of_all(triangulation, metric_triangles(triangulation, everywhere)) ==
                  triangles_of(elliptical));
      // And back again.
      const MetricField2 none(std::vector<MetricField2::Region>{});
      ASSERT_TRUE(corners_of_all(elliptical, metric_triangles(elliptical, none)) ==
                  triangles_of(triangulation));
    }
  }
}

TEST(MetricTriangles2, AlsoStartFromAnEllipticalTriangulation) {
  const auto points = make_points<double>(PointSet::seven_bits, 700, 45);
  Elliptical2 triangulation(ellipse_map(3, 1, 80));
  triangulation.build(points);
  const MetricField2 field([&](const PlanePoint& p) {
    return p[0] < 60 ? triangulation.metric().map() : ellipse_map(1, 6, 10);
  });
  EXPECT_GT(check(triangles_of(triangulation),
                  corners_of_all(triangulation, metric_triangles(triangulation, field)), field,
                  triangulation.metric().map()),
            100u);
}

TEST(MetricTriangles2, WindowsDependOnPointsAndWindowAlone) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    auto points = make_points<double>(PointSet::seven_bits, 600, 46 + seed);
    const MetricField2 field = three_regions(points);
    const double x = static_cast<double>(random() % 100), y = static_cast<double>(random() % 100);
    const Box3 window = box2(x, y, x + 40, y + 25);
    Delaunay2<double> triangulation;
    triangulation.build(points);
    const auto result =
        corners_of_all(triangulation, metric_triangles(triangulation, field, window));
    std::vector<Corners> before;
    for (const Corners& t : triangles_of(triangulation)) {
      const auto [x0, x1] = std::minmax({t[0][0], t[1][0], t[2][0]});
      const auto [y0, y1] = std::minmax({t[0][1], t[1][1], t[2][1]});
      if (x0 <= x + 40 && x <= x1 && y0 <= y + 25 && y <= y1) before.push_back(t);
    }
    check(before, result, field);
    std::shuffle(points.begin(), points.end(), random);
    Delaunay2<double> other;
    for (const auto& p : points) other.insert(p);
    EXPECT_TRUE(corners_of_all(other, metric_triangles(other, field, window)) == result);
    // Infinite in all directions: covers everything.
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(
        metric_triangles(other, field, box2(-kInfinity, -kInfinity, kInfinity, kInfinity)) ==
        metric_triangles(other, field));
  }
}

TEST(MetricField2, RejectsInvalidFields) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Regions = std::vector<MetricField2::Region>;
  const auto refuses = [](Regions regions, const std::string& where) {
    try {
      const MetricField2 field(std::move(regions));
      ADD_FAILURE() << where;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(where), std::string::npos) << error.what();
    }
  };
  const Box3 box = box2(0, 0, 1, 1);
  refuses({{box, kIdentityMap<2>}, {box2(1, 0, 0, 1), kIdentityMap<2>}}, "region 1");
  refuses({{box2(0, kNan, 1, 1), kIdentityMap<2>}}, "region 0");
  refuses({{box, {1, 1, 1, 1}}}, "region 0");
  EXPECT_THROW(MetricField2(std::function<LinearMap2(const PlanePoint&)>()), std::invalid_argument);

  Delaunay2<double> triangulation;
  triangulation.build(std::vector<PlanePoint>{{0, 0}, {1, 0}, {0, 1}, {1, 1}});
  const MetricField2 bad([&](const PlanePoint& p) {
    return p[0] > 0 ? LinearMap2{1, 0, 0, kNan} : kIdentityMap<2>;
  });
  EXPECT_THROW(static_cast<void>(metric_triangles(triangulation, bad)), std::invalid_argument);
  // Boxes are closed, the first one applies, and the metric is Euclidean outside.
  const MetricField2 field({{box, {2, 0, 0, 1}}, {box2(1, 0, 2, 1), {3, 0, 0, 1}}});
  EXPECT_EQ(field({1, 1})[0], 2);
  EXPECT_EQ(field({1.5, 0})[0], 3);
  EXPECT_EQ(field({2.5, 0}), kIdentityMap<2>);
}

}  // namespace
}  // namespace terrace::tri::test
