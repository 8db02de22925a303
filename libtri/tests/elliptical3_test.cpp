// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "metrics3.hpp"
#include "multiresolution_hierarchy.hpp"
#include "points3.hpp"
#include "terrace/tri/metric.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri::test {
namespace {

// ---- Laws --------------------------------------------------------------------------------------

TEST(EllipticalMetric3, NoVertexIsInsideAnEllipsoid) {
  for (std::size_t axes = 2; axes < rotations().size(); axes += TERRACE_TEST_SHARE) {
    const LinearMap3 map = ellipsoid_map({4, 1, 2}, rotations()[axes]);
    for (const PointSet3 kind : kPointSets3) {
      SCOPED_TRACE(name(kind) + " axes " + std::to_string(axes));
      Elliptical3 triangulation(map);
      triangulation.build(make_points3<double>(kind, 25, 2));
      ASSERT_EQ(find_fault(triangulation), "");
      for (const Corners3& t : tetrahedra_of(triangulation))
        for (const VertexId v : triangulation.all_vertices())
          ASSERT_LE(in_ellipsoid(map, t, triangulation.point(v)), 0);
    }
  }
}

TEST(EllipticalMetric3, SpherePreservingMapsGiveDelaunay3) {
  for (const LinearMap3& map :
       {kIdentityMap<3>, LinearMap3{1e-200, 0, 0, 0, 1e-200, 0, 0, 0, 1e-200},
        LinearMap3{0, -3, 0, 3, 0, 0, 0, 0, 3}, LinearMap3{0, 1, 0, 0, 0, 1, 1, 0, 0},
        LinearMap3{3, -4, 0, 4, 3, 0, 0, 0, 5}, LinearMap3{2, -1, 2, 2, 2, -1, -1, 2, 2},
        LinearMap3{1e300, 0, 0, 0, -1e300, 0, 0, 0, 1e300}}) {
    for (const PointSet3 kind : kPointSets3) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(map[0]));
      const auto points = make_points3<double>(kind, 200, 3);
      Elliptical3 elliptical(map);
      Delaunay3<double> plain;
      elliptical.build(points);
      plain.build(points);
      ASSERT_EQ(elliptical.hash(), plain.hash());
      ASSERT_EQ(elliptical.tetrahedron_count(), plain.tetrahedron_count());
    }
  }
}

/// Maps of integers and powers of two that keep the lexicographic order, so that small integer
/// points are mapped without rounding.
TEST(EllipticalMetric3, IntegerPointsAndMapsGiveDelaunay3OfMappedPoints) {
  for (const LinearMap3& m :
       {LinearMap3{4, 0, 0, 0, 1, 0, 0, 0, 0.5}, LinearMap3{1, 0, 0, 3, 1, 0, -2, 5, 1},
        LinearMap3{2, 0, 0, -7, 0.25, 0, 1, 0, 8}, LinearMap3{1, 0, 0, 0, 1, 0, 1, -1, 1}}) {
    for (const PointSet3 kind : {PointSet3::five_bits, PointSet3::grid, PointSet3::slab,
                                 PointSet3::plane, PointSet3::off_plane, PointSet3::line,
                                 PointSet3::sphere, PointSet3::curves, PointSet3::clusters}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(m[3]));
      const auto points = make_points3<double>(kind, 400, 4);
      std::vector<Space> mapped;
      for (const Space& p : points)
        mapped.push_back(
            {m[0] * p[0], m[3] * p[0] + m[4] * p[1], m[6] * p[0] + m[7] * p[1] + m[8] * p[2]});
      Elliptical3 elliptical(m);
      Delaunay3<double> plain;
      const auto vertices = elliptical.build(points);
      const auto plain_ids = plain.build(mapped);
      // Equal vertices, compared by the points from which they were made.
      std::vector<Corners3> expected;
      std::vector<Space> original(plain.vertex_slots());
      for (std::size_t i = 0; i < points.size(); ++i) {
        original[slot(plain_ids[i])] = points[i];
        ASSERT_EQ(elliptical.point(vertices[i]), points[i]);
      }
      for (const TetrahedronId t : plain.all_tetrahedra()) {
        Corners3 corners;
        for (std::size_t i = 0; i < 4; ++i) corners[i] = original[slot(plain.vertices(t)[i])];
        std::sort(corners.begin(), corners.end());
        expected.push_back(corners);
      }
      std::sort(expected.begin(), expected.end());
      ASSERT_TRUE(tetrahedra_of(elliptical) == expected);
    }
  }
}

TEST(EllipticalMetric3, RandomOperationsEqualRebuild) {
  const LinearMap3 maps[] = {ellipsoid_map({5, 1, 2}, rotations()[3]),
                             {1, 0, 0, 0, 2, 0, 0, 0, 1},
                             ellipsoid_map({1000, 1, 1}, rotations()[4])};
  for (const PointSet3 kind : kPointSets3) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points3<double>(kind, 120, seed + 100);
      Elliptical3 triangulation(maps[seed]);
      std::vector<Elliptical3::Insertion> results;
      for (int step = 0; step < 12; ++step) {
        std::vector<VertexId> alive;
        for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
        const std::size_t begin = random() % points.size();
        const std::size_t count = std::min<std::size_t>(random() % 60, points.size() - begin);
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
        std::vector<Space> left;
        for (const VertexId v : triangulation.all_vertices())
          left.push_back(triangulation.point(v));
        std::shuffle(left.begin(), left.end(), random);
        Elliptical3 rebuilt(maps[seed]);
        rebuilt.build(left);
        ASSERT_EQ(triangulation.hash(), rebuilt.hash()) << "step " << step;
      }
    }
  }
}

TEST(EllipticalMetric3, ResultDoesNotDependOnThreads) {
  const LinearMap3 map = ellipsoid_map({6, 1, 3}, rotations()[3]);
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::grid, PointSet3::clusters}) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<double>(kind, 12'000, 6);
    Elliptical3 one(map), two(map);
    const auto vertices = one.build(points, 1);
    ASSERT_EQ(two.build(points, 2), vertices);
    ASSERT_EQ(find_fault(two), "");
    ASSERT_EQ(one.hash(), two.hash());
    ASSERT_EQ(one.tetrahedron_slots(), two.tetrahedron_slots());
    for (const TetrahedronId t : one.all_tetrahedra()) ASSERT_EQ(one.vertices(t), two.vertices(t));
    // Sets so large that the filter for many vertices at once decides.
    std::vector<VertexId> going;
    for (const VertexId v : two.all_vertices())
      if (slot(v) < 2500) going.push_back(v);
    two.remove(going);
    ASSERT_EQ(find_fault(two), "");
  }
}

TEST(EllipticalMetric3, NearestIsNearestInTheMetric) {
  const LinearMap3 map = ellipsoid_map({6, 1, 2}, rotations()[4]);
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::few_bits, PointSet3::grid,
                               PointSet3::sphere, PointSet3::plane}) {
    SCOPED_TRACE(name(kind));
    Elliptical3 triangulation(map);
    triangulation.build(make_points3<double>(kind, 100, 8));
    for (const Space& q : make_points3<double>(kind, 40, 9)) {
      VertexId best = kNoVertex;
      Rational least;
      for (const VertexId v : triangulation.all_vertices()) {
        const Space p = triangulation.point(v);
        const Rational d = square(map, exact_difference(p, q));
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

TEST(EllipticalMetric3, RefusesBadInputAndStaysUnchanged) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(EllipticalMetric3({1, 2, 3, 4, 5, 6, 7, 8, 9}), std::invalid_argument);
  EXPECT_THROW(EllipticalMetric3({0, 0, 0, 0, 0, 0, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(EllipticalMetric3({1, 0, 0, 0, 1, 0, 0, 0, kNan}), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipsoid_map({0, 1, 1})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipsoid_map({1, 1e-320, 1})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipsoid_map({1, 1, kNan})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(ellipsoid_map({1, 1, 1}, {1, 1, 0, 0, 1, 0, 0, 0, 1})),
               std::invalid_argument);
  Elliptical3 triangulation(LinearMap3{1, 0, 0, 0, 2, 0, 0, 0, 1});
  try {
    triangulation.build(std::vector<Space>{{0, 0, 0}, {1, 0, 0}, {0, 0, kNan}});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("point 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(triangulation.insert({kNan, 0, 0}), std::invalid_argument);
  EXPECT_EQ(triangulation.vertex_count(), 0u);
  EXPECT_EQ(triangulation.nearest({0, 0, 0}), kNoVertex);
  triangulation.build({});
  triangulation.insert({1, 1, 1});
  EXPECT_EQ(triangulation.tetrahedron_count(), 0u);
  EXPECT_EQ(find_fault(triangulation), "");
}

TEST(Metric3, MapsMeasureEllipsoids) {
  const LinearMap3& axes = rotations()[3];
  const std::array<double, 3> radii{5, 0.5, 2};
  const LinearMap3 map = ellipsoid_map(radii, axes);
  for (std::size_t i = 0; i < 3; ++i) {
    const Space radius{axes[3 * i] * radii[i], axes[3 * i + 1] * radii[i],
                       axes[3 * i + 2] * radii[i]};
    EXPECT_NEAR(metric_length(map, radius), 1.0, 1e-15);
  }
  EXPECT_EQ(ellipsoid_map({2, 4, 8}), (LinearMap3{0.5, 0, 0, 0, 0.25, 0, 0, 0, 0.125}));
}

TEST(MetricField3, FirstOfSeveralClosedBoxesApplies) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Regions = std::vector<MetricField3::Region>;
  const auto refuses = [](Regions regions, const std::string& where) {
    try {
      const MetricField3 field(std::move(regions));
      ADD_FAILURE() << where;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(where), std::string::npos) << error.what();
    }
  };
  const Box3 box{{0, 0, 0}, {1, 1, 1}};
  refuses({{box, kIdentityMap<3>}, {{{0, 0, 1}, {1, 1, 0}}, kIdentityMap<3>}}, "region 1");
  refuses({{{{0, kNan, 0}, {1, 1, 1}}, kIdentityMap<3>}}, "region 0");
  refuses({{box, {1, 1, 1, 1, 1, 1, 1, 1, 1}}}, "region 0");
  EXPECT_THROW(MetricField3(std::function<LinearMap3(const Space&)>()), std::invalid_argument);
  const MetricField3 field(
      {{box, ellipsoid_map({0.5, 1, 1})}, {{{1, 0, 0}, {2, 1, 1}}, ellipsoid_map({0.25, 1, 1})}});
  EXPECT_EQ(field({1, 1, 1})[0], 2);
  EXPECT_EQ(field({1.5, 0, 1})[0], 4);
  EXPECT_EQ(field({2.5, 0, 0}), kIdentityMap<3>);
  EXPECT_EQ(field({0.5, 0.5, 1.5}), kIdentityMap<3>);
}

// ---- Levels of detail --------------------------------------------------------------------------

TEST(EllipticalModel3, HasLevelsOfDetail) {
  const LinearMap3 map = ellipsoid_map({3, 1, 2}, rotations()[3]);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    for (const std::size_t range : {std::size_t{5}, std::size_t{1} << 20}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " range " << range);
      std::mt19937_64 random(seed);
      std::vector<Point3> points(300);
      for (Point3& p : points)
        for (double& c : p) c = static_cast<double>(below(random, range));
      MemorySource source = make_hierarchy(points, 2, 8.0, random);
      MultiresolutionModel<Elliptical3> model(source, {}, {}, Elliptical3(map));
      const std::uint64_t coarse = model.triangulation().hash();
      for (int step = 0; step < 12; ++step) {
        const auto corner = [&] { return static_cast<double>(below(random, range)); };
        const Box3 box{{0, 0, 0}, {corner(), corner(), corner()}};
        switch (below(random, 3)) {
          case 0:
            model.refine(box, static_cast<unsigned>(below(random, 2)));
            break;
          case 1:
            model.coarsen(box, 1 + static_cast<unsigned>(below(random, 2)));
            break;
          default:
            model.set_detail({2, {{box, 0}}});
        }
        ASSERT_EQ(find_fault(model.triangulation()), "");
        // The points present, derived from the expanded clusters alone.
        std::vector<Space> present = source.root().positions;
        for (const ClusterId id : model.expanded()) {
          const auto& more = source.at(id).positions;
          present.insert(present.end(), more.begin(), more.end());
        }
        Elliptical3 scratch(map);
        scratch.build(present);
        ASSERT_EQ(model.triangulation().hash(), scratch.hash());
      }
      model.set_level(0);
      Elliptical3 mesh(map);
      mesh.build(points);
      ASSERT_EQ(model.triangulation().hash(), mesh.hash());
      model.set_level(Detail::kTop);
      ASSERT_EQ(model.triangulation().hash(), coarse);
      ASSERT_EQ(model.triangulation().metric().map(), map);
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
