// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "metrics.hpp"
#include "model/multiresolution.hpp"
#include "multiresolution_hierarchy.hpp"
#include "multiresolution_oracle.hpp"
#include "points.hpp"
#include "terrace/tri/metric.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri::test {
namespace {

// ---- Laws --------------------------------------------------------------------------------------

TEST(EllipticalMetric2, NoVertexIsInsideAnEllipse) {
  // Symmetric maps on points with ties, for which CGAL may choose differently among mapped points.
  const LinearMap2 map = ellipse_map(4, 1, 30);
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    Elliptical2 triangulation(map);
    triangulation.build(make_points<double>(kind, 40, 2));
    ASSERT_EQ(find_fault(triangulation), "");
    for (const TriangleId id : triangulation.all_triangles()) {
      const Corners t = corners_of(triangulation, triangulation.vertices(id));
      for (const VertexId v : triangulation.all_vertices())
        ASSERT_LE(in_ellipse(map, t[0], t[1], t[2], triangulation.point(v)), 0);
    }
  }
}

TEST(EllipticalMetric2, CirclePreservingMapsGiveDelaunay2) {
  for (const LinearMap2& map :
       {kIdentityMap<2>, LinearMap2{1e-200, 0, 0, 1e-200}, LinearMap2{0, -3, 3, 0},
        LinearMap2{0, 1, 1, 0}, LinearMap2{3, -4, 4, 3}, LinearMap2{1e300, 0, 0, -1e300}}) {
    for (const PointSet kind : kPointSets) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(map[0]));
      const auto points = make_points<double>(kind, 300, 3);
      Elliptical2 elliptical(map);
      Delaunay2<double> plain;
      elliptical.build(points);
      plain.build(points);
      ASSERT_EQ(elliptical.hash(), plain.hash());
      ASSERT_EQ(elliptical.triangle_count(), plain.triangle_count());
    }
  }
}

TEST(EllipticalMetric2, RandomOperationsEqualRebuild) {
  const LinearMap2 maps[] = {ellipse_map(5, 1, 33), {1, 0, 0, 2}, ellipse_map(100, 1, 90)};
  for (const PointSet kind : kPointSets) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points<double>(kind, 250, seed + 100);
      Elliptical2 triangulation(maps[seed]);
      std::vector<Elliptical2::Insertion> results;
      for (int step = 0; step < 30; ++step) {
        std::vector<VertexId> alive;
        for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
        const std::size_t begin = random() % points.size();
        const std::size_t count = std::min<std::size_t>(random() % 50, points.size() - begin);
        const auto some = std::span(points).subspan(begin, count);
        switch (random() % 4) {
          case 0:
            for (const auto& p : some) triangulation.insert(p);
            break;
          case 1:
            results.resize(count);
            triangulation.insert(some, results);
            for (std::size_t i = 0; i < count; ++i)
              ASSERT_EQ(triangulation.point(results[i].vertex), some[i]);
            break;
          case 2:
            std::shuffle(alive.begin(), alive.end(), random);
            alive.resize(random() % (alive.size() + 1));
            for (const VertexId v : alive) triangulation.remove(v);
            break;
          default:
            std::shuffle(alive.begin(), alive.end(), random);
            alive.resize(random() % (alive.size() + 1));
            triangulation.remove(std::span<const VertexId>(alive));
        }
        ASSERT_EQ(find_fault(triangulation), "") << "step " << step;
        std::vector<PlanePoint> left;
        for (const VertexId v : triangulation.all_vertices())
          left.push_back(triangulation.point(v));
        std::shuffle(left.begin(), left.end(), random);
        Elliptical2 rebuilt(maps[seed]);
        rebuilt.build(left);
        ASSERT_EQ(triangulation.hash(), rebuilt.hash()) << "step " << step;
      }
    }
  }
}

TEST(EllipticalMetric2, PointsWithEqualMappedPositionsStayApart) {
  // An ellipse so flat and coordinates so large that neighbours along it have the same mapped
  // doubles.
  const LinearMap2 map = ellipse_map(1e12, 1, 45);
  std::vector<PlanePoint> points;
  for (int i = 0; i < 30; ++i) {
    const double at = 1e9 + i * 0x1p-20;
    points.push_back({at, at});
    points.push_back({at, at + 3 + i % 2});
  }
  const auto mapped = [&](const PlanePoint& p) {
    return PlanePoint{map[0] * p[0] + map[1] * p[1], map[2] * p[0] + map[3] * p[1]};
  };
  ASSERT_EQ(mapped(points[0]), mapped(points[2]));
  Elliptical2 triangulation(map);
  const auto vertices = triangulation.build(points);
  EXPECT_EQ(triangulation.vertex_count(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(triangulation.point(vertices[i]), points[i]);
  EXPECT_EQ(find_fault(triangulation), "");
  // Only points with equal coordinates share a vertex.
  EXPECT_FALSE(triangulation.insert(points[7]).created);
  EXPECT_TRUE(triangulation.insert({1e9, std::nextafter(1e9, 2e9)}).created);
  EXPECT_EQ(find_fault(triangulation), "");
}

TEST(EllipticalMetric2, NearestIsNearestInTheMetric) {
  const LinearMap2 map = ellipse_map(6, 1, 20);
  for (const PointSet kind : {PointSet::uniform, PointSet::few_bits, PointSet::grid,
                              PointSet::circle, PointSet::horizontal}) {
    SCOPED_TRACE(name(kind));
    Elliptical2 triangulation(map);
    triangulation.build(make_points<double>(kind, 100, 8));
    for (const PlanePoint& q : make_points<double>(kind, 60, 9)) {
      using Q = CGAL::Exact_rational;
      VertexId best = kNoVertex;
      Q least;
      for (const VertexId v : triangulation.all_vertices()) {
        const PlanePoint p = triangulation.point(v);
        const Q d = square(map, Q(p[0]) - Q(q[0]), Q(p[1]) - Q(q[1]));
        if (best == kNoVertex || d < least || (d == least && p < triangulation.point(best))) {
          best = v;
          least = d;
        }
      }
      ASSERT_EQ(triangulation.nearest(q), best);
      if (triangulation.point(best) == q) {
        ASSERT_EQ(triangulation.locate(q).vertex, best);
      }
    }
  }
}

/// Grids are triangulated in the Euclidean metric only.
template <class Triangulation>
concept HasGrid = requires(Triangulation t) {
  t.build_grid(0.0, 0.0, 1.0, 2u, 2u);
};
static_assert(HasGrid<Delaunay2<double>> && !HasGrid<Elliptical2>);

TEST(EllipticalMetric2, RefusesBadInputAndStaysUnchanged) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(EllipticalMetric2({1, 2, 2, 4}), std::invalid_argument);
  EXPECT_THROW(EllipticalMetric2({0, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(EllipticalMetric2({1, 0, 0, kNan}), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipse_map(0, 1, 0)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipse_map(1, 1e-320, 0)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipse_map(1, 1, kNan)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipse_map(1, 1, std::array{1.0, 1.0})), std::invalid_argument);
  Elliptical2 triangulation(LinearMap2{1, 0, 0, 2});
  try {
    triangulation.build(std::vector<PlanePoint>{{0, 0}, {1, 0}, {0, kNan}});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("point 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(triangulation.insert({kNan, 0}), std::invalid_argument);
  EXPECT_EQ(triangulation.vertex_count(), 0u);
  EXPECT_EQ(triangulation.nearest({0, 0}), kNoVertex);
  triangulation.build({});
  triangulation.insert({1, 1});
  EXPECT_EQ(triangulation.triangle_count(), 0u);
  EXPECT_EQ(find_fault(triangulation), "");
}

TEST(Metric2, MapsMeasureEllipses) {
  // Radii have length 1.
  const LinearMap2 map = ellipse_map(3, 2, 90);
  EXPECT_EQ(map[0] * 2.0, 1.0);
  EXPECT_EQ(map[3] * 3.0, 1.0);
  EXPECT_EQ(map[1], 0.0);
  const LinearMap2 turned = ellipse_map(5, 1, 30);
  const double c = std::sqrt(0.75), s = 0.5;
  EXPECT_NEAR(
      std::hypot(turned[0] * 5 * c + turned[1] * 5 * s, turned[2] * 5 * c + turned[3] * 5 * s), 1.0,
      1e-15);
  EXPECT_NEAR(std::hypot(turned[1] * c - turned[0] * s, turned[3] * c - turned[2] * s), 1.0, 1e-15);
  // Restrictions of maps of space: an axis-parallel one bit for bit, another one by its lengths.
  EXPECT_EQ(plane_map({turned[0], turned[1], 0, turned[2], turned[3], 0, 0, 0, 9}), turned);
  const std::array<double, 9> m{2, 0.5, 0.25, 0.5, 1, -0.5, 0.25, -0.5, 3};
  const LinearMap2 flat = plane_map(m);
  for (const PlanePoint& v : {PlanePoint{1, 0}, PlanePoint{0, 1}, PlanePoint{-2, 3}}) {
    EXPECT_NEAR(
        std::hypot(flat[0] * v[0] + flat[1] * v[1], flat[2] * v[0] + flat[3] * v[1]),
        std::hypot(m[0] * v[0] + m[1] * v[1], m[3] * v[0] + m[4] * v[1], m[6] * v[0] + m[7] * v[1]),
        1e-14);
  }
  EXPECT_THROW(static_cast<void>(plane_map({0, 0, 1, 0, 1, 0, 0, 0, 1})), std::invalid_argument);
}

// ---- Levels of detail --------------------------------------------------------------------------

constexpr LinearMap2 kSlanted{0.3, -0.2, -0.2, 0.9};
/// Has a fixed metric, as the oracle makes triangulations by default.
struct Slanted : Elliptical2 {
  Slanted() : Elliptical2(kSlanted) {}
};

TEST(EllipticalModel, HasLevelsOfDetail) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const Shape shape : {Shape::random, Shape::grid, Shape::duplicates, Shape::line}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", shape " << static_cast<int>(shape));
      std::mt19937_64 random(seed);
      MemorySource source = make_hierarchy(make_points(shape, 150, random), 3, 4.0, random);
      const WholeTree tree(source);
      MultiresolutionModel<Slanted> model(source);
      const std::uint64_t coarse = model.triangulation().hash();
      Consumer<Slanted> consumer(model);
      for (int step = 0; step < 8; ++step) {
        Detail detail;
        detail.level = static_cast<unsigned>(below(random, source.top() + 1));
        const auto& p = source.root().positions[below(random, source.root().positions.size())];
        detail.focuses.push_back({box2(p[0] - 5, p[1] - 5, p[0] + 5, p[1] + 5), 0});
        consumer.apply(model.set_detail(detail));
        ASSERT_NO_FATAL_FAILURE(check_model(model, source, wanted(tree, source, detail)));
        ASSERT_NO_FATAL_FAILURE(consumer.check());
        ASSERT_EQ(find_fault(model.triangulation()), "");
      }
      model.set_level(source.top());
      ASSERT_EQ(model.triangulation().hash(), coarse);

      // The metric may be passed to the model.
      MultiresolutionModel<Elliptical2> with_metric(source, {}, {}, Elliptical2(kSlanted));
      ASSERT_EQ(with_metric.triangulation().hash(), coarse);
      ASSERT_EQ(with_metric.triangulation().metric().map(), kSlanted);
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
