// SPDX-License-Identifier: Apache-2.0
// The poles rule, compared with its definition, and on synthetic surfaces, open ones, and parts
// that touch.
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "points3.hpp"
#include "poles_oracle.hpp"
#include "shape/extract_surface.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

using Points = std::vector<Point3>;
constexpr double kTurn = 2 * std::numbers::pi;

template <class Coord>
class PolesLawTest : public ::testing::Test {};
using PolesCoords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(PolesLawTest, PolesCoords);

TYPED_TEST(PolesLawTest, EqualsTheDefinition) {
  for (const PointSet3 kind : kPointSets3) {
    // The oracle does not scale, so its numbers would overflow or vanish.
    if (kind == PointSet3::huge || kind == PointSet3::tiny) continue;
    for (const std::size_t count : {0u, 4u, 5u, 8u, 20u, 45u}) {
      if (kind == PointSet3::curves && count > 8) continue;
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE(name(kind) + " " + std::to_string(count) + ", seed " + std::to_string(seed));
        Delaunay3<TypeParam> triangulation;
        triangulation.build(make_points3<TypeParam>(kind, count, seed));
        Shape3<TypeParam> shape;
        shape.restore(triangulation);
        for (const auto order : {PolesOracle::Order::kruskal, PolesOracle::Order::prim}) {
          const PolesOracle oracle(triangulation, order);
          ASSERT_EQ(kept_set(triangulation, shape), oracle.inside);
          ASSERT_EQ(shape.lost_vertices().size(), oracle.missed_vertices.size());
        }
      }
    }
  }
}

/// Points on the surface of a box with a lattice of this many cells along each side.
Points box(std::array<int, 3> cells, Point3 low = {}) {
  Points points;
  for (int x = 0; x <= cells[0]; ++x)
    for (int y = 0; y <= cells[1]; ++y)
      for (int z = 0; z <= cells[2]; ++z)
        if (x == 0 || y == 0 || z == 0 || x == cells[0] || y == cells[1] || z == cells[2])
          points.push_back({low[0] + x, low[1] + y, low[2] + z});
  return points;
}

/// Points distributed evenly on a spiral, each moved by up to `noise` along every axis.
Points ball(std::size_t count, double radius, Point3 centre, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto moved = [&] { return noise * (static_cast<double>(random() >> 11) * 0x1p-52 - 1.0); };
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - z * z), angle = static_cast<double>(i) * 2.399963229728653;
    points.push_back({centre[0] + radius * r * std::cos(angle) + moved(),
                      centre[1] + radius * r * std::sin(angle) + moved(),
                      centre[2] + radius * z + moved()});
  }
  return points;
}

void expect_solid(const RestoredSurface& found, std::size_t points, std::size_t components,
                  std::int64_t euler, double volume, double tolerance) {
  const SurfaceMeasures measured = measure(found.surface);
  EXPECT_TRUE(measured.closed);
  EXPECT_FALSE(found.open);
  EXPECT_EQ(found.surface.points.size(), points);
  EXPECT_EQ(found.unused_points, 0u);
  EXPECT_EQ(found.parts.components, components);
  EXPECT_EQ(found.parts.euler_characteristic, euler);
  EXPECT_EQ(measured.non_manifold_edges, 0u);
  EXPECT_NEAR(measured.volume / volume, 1.0, tolerance);
}

TEST(PolesTest, RestoresALatticeOnABoxDespiteTies) {
  for (const auto& cells : {std::array{6, 6, 6}, std::array{12, 9, 5}, std::array{20, 20, 2}}) {
    SCOPED_TRACE(std::to_string(cells[0]) + " x " + std::to_string(cells[2]));
    Points points = box(cells);
    const double volume = cells[0] * cells[1] * cells[2];
    const RestoredSurface first = restore_surface(points);
    expect_solid(first, points.size(), 1, 2, volume, 1e-12);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      std::shuffle(points.begin(), points.end(), std::mt19937_64(seed));
      EXPECT_EQ(measure(restore_surface(points).surface).volume, measure(first.surface).volume);
    }
  }
}

TEST(PolesTest, RestoresAThinPlateOfRandomSamples) {
  // A twentieth as thick as wide, slightly more than the spacing of the samples.
  std::mt19937_64 random(3);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Points points;
  for (int i = 0; i < 6000; ++i) {
    const double x = unit(), y = unit();
    points.push_back({x, y, i % 2 == 0 ? 0.0 : 0.05});
  }
  for (int i = 0; i < 1200; ++i) {
    const double position = unit(), z = 0.05 * unit();
    const double end = i % 2 == 0 ? 0.0 : 1.0;
    points.push_back(i % 4 < 2 ? Point3{position, end, z} : Point3{end, position, z});
  }
  const RestoredSurface found = restore_surface(points);
  EXPECT_TRUE(measure(found.surface).closed);
  EXPECT_EQ(found.parts.components, 1u);
  EXPECT_EQ(found.parts.euler_characteristic, 2);
  EXPECT_LE(found.unused_points, 7u);
  EXPECT_NEAR(measure(found.surface).volume, 0.05, 0.002);
}

TEST(PolesTest, RestoresNestedShellsAndSeparateParts) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Points points = ball(4000, 1.0, {}, 0.01, seed);
    for (const Points& more :
         {ball(1500, 0.6, {}, 0.008, seed + 10), ball(300, 0.2, {0.1, 0, 0}, 0.005, seed + 20),
          ball(800, 0.4, {1.7, 0.3, 0}, 0.005, seed + 30)})
      points.insert(points.end(), more.begin(), more.end());
    // A hollow ball with a ball in it, and a ball next to it.
    const double volume = 2 * kTurn / 3 * (1.0 - 0.216 + 0.008 + 0.064);
    expect_solid(restore_surface(points), points.size(), 4, 8, volume, 0.02);
  }
}

TEST(PolesTest, RestoresATorusOfVaryingDensity) {
  Points points;
  for (int i = 0; i < 9000; ++i) {
    const double s = i / 9000.0;
    const double u = kTurn * s * s * (3 - 2 * s), v = kTurn * std::fmod(i * 0.6180339887498949, 1);
    points.push_back({(1 + 0.4 * std::cos(v)) * std::cos(u), (1 + 0.4 * std::cos(v)) * std::sin(u),
                      0.4 * std::sin(v)});
  }
  expect_solid(restore_surface(points), points.size(), 1, 0, kTurn * kTurn / 2 * 0.16, 0.02);
}

TEST(PolesTest, OpenScansAreLeftOpen) {
  // The lower two thirds of a ball, and a round dome seen from above.
  Points bowl = ball(6000, 1.0, {}, 0.002, 5), sheet;
  std::erase_if(bowl, [](const Point3& p) { return p[2] > 0.35; });
  for (int i = 0; i < 90; ++i)
    for (int j = 0; j < 90; ++j) {
      const double x = i + 0.3 * std::sin(i * 7.0 + j), y = j + 0.3 * std::cos(i + j * 5.0);
      const double r2 = (x - 45) * (x - 45) + (y - 45) * (y - 45);
      if (r2 < 44 * 44) sheet.push_back({x, y, -0.01 * r2});
    }
  for (const Points& points : {bowl, sheet}) {
    SCOPED_TRACE(std::to_string(points.size()) + " points");
    const RestoredSurface found = restore_surface(points);
    const SurfaceMeasures measured = measure(found.surface);
    EXPECT_TRUE(found.open);
    EXPECT_FALSE(measured.closed);
    EXPECT_EQ(found.parts.components, 1u);
    EXPECT_EQ(found.parts.euler_characteristic, 1);  // a disc
    EXPECT_EQ(measured.euler_characteristic, 1);
    EXPECT_EQ(measured.non_manifold_edges, 0u);
    EXPECT_GT(static_cast<double>(measured.vertices), 0.999 * static_cast<double>(points.size()));
  }
  const SurfaceMeasures measured = measure(restore_surface(bowl).surface);
  EXPECT_NEAR(measured.area, kTurn * 1.35, 0.05 * kTurn * 1.35);
}

TEST(PolesTest, LidsOfAClosedSurfaceStay) {
  const Points points = ball(2000, 1.0, {}, 0.01, 7);
  Delaunay3<double> triangulation;
  triangulation.build(points);
  Shape3<double> shape;
  shape.restore(triangulation);
  const ShapeSurface surface = shape.surface_without_lids(triangulation);
  EXPECT_FALSE(surface.open);
  EXPECT_EQ(surface.surface.faces, shape.surface(triangulation).surface.faces);
}

TEST(PolesTest, TouchingPartsAreSeparated) {
  // Cubes of two units. The second shares an edge with the first, the third a corner with the
  // second. The fourth shares a face with the second, an edge with the third and a corner with the
  // first.
  const std::array<std::array<std::int32_t, 3>, 4> lows{
      {{0, 0, 0}, {2, 2, 0}, {4, 4, 2}, {2, 2, 2}}};
  Delaunay3<std::int32_t> triangulation;
  triangulation.build([] {
    std::vector<std::array<std::int32_t, 3>> points;
    for (std::int32_t x = 0; x <= 6; ++x)
      for (std::int32_t y = 0; y <= 6; ++y)
        for (std::int32_t z = 0; z <= 4; ++z) points.push_back({x, y, z});
    return points;
  }());
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  for (const auto& [cubes, components, euler] :
       {std::tuple{1, 1, 2}, std::tuple{2, 2, 4}, std::tuple{3, 3, 6}, std::tuple{4, 3, 6}}) {
    SCOPED_TRACE(std::to_string(cubes) + " cubes");
    shape::State state;
    shape::keep_all(mesh, state);
    for (const TetrahedronId t : triangulation.all_tetrahedra()) {
      bool inside = false;
      for (std::size_t cube = 0; cube < static_cast<std::size_t>(cubes); ++cube) {
        bool within = true;
        for (const VertexId v : triangulation.vertices(t))
          for (std::size_t k = 0; k < 3; ++k)
            within = within && triangulation.point(v)[k] >= lows[cube][k] &&
                     triangulation.point(v)[k] <= lows[cube][k] + 2;
        inside = inside || within;
      }
      if (!inside) state.remove(mesh, slot(t), 0);
    }
    const ShapeSurface surface = shape::surface_of(mesh, state);
    const SurfaceMeasures measured = measure(surface.surface);
    EXPECT_EQ(measured.volume, 8.0 * cubes);
    EXPECT_EQ(measured.non_manifold_edges, cubes == 1 ? 0u : cubes == 4 ? 4u : 2u);
    const ShapeParts parts = shape::parts_apart(mesh, state, surface);
    EXPECT_EQ(parts.components, static_cast<std::size_t>(components));
    EXPECT_EQ(parts.euler_characteristic, euler);
  }
}

TEST(PolesTest, AnyNumberOfThreadsGivesTheSame) {
  const auto points = make_points3<double>(PointSet3::sphere, 20000, 3);
  Points more = ball(20000, 1.0, {}, 0.01, 4);
  more.insert(more.end(), points.begin(), points.end());
  Delaunay3<double> triangulation;
  triangulation.build(more);
  Shape3<double> one;
  one.restore(triangulation);
  for (const unsigned threads : {0u, 2u, 5u}) {
    Shape3<double> other;
    other.restore(triangulation, threads);
    ASSERT_EQ(one.kept_tetrahedra(), other.kept_tetrahedra());
  }
}

TEST(PolesTest, NearbyUpdatesFollowChanges) {
  for (std::uint64_t seed = 1; seed <= 4; seed += TERRACE_TEST_SHARE) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Delaunay3<double> triangulation;
    triangulation.build(ball(6000, 1.0, {}, 0.02, seed));
    Shape3<double> shape;
    triangulation.start_journal();
    shape.restore(triangulation);
    std::mt19937_64 random(seed);
    Delaunay3<double>::Changes changes;
    std::size_t wrong = 0, compared = 0;
    for (int step = 0; step < 20; ++step) {
      // A cap of the ball is removed, or added again with more samples.
      const Point3 on = ball(1000, 1.0, {}, 0.0, 0)[random() % 1000];
      std::vector<VertexId> near;
      for (const VertexId v : triangulation.all_vertices()) {
        const Point3 p = triangulation.point(v);
        if (p[0] * on[0] + p[1] * on[1] + p[2] * on[2] > 0.97) near.push_back(v);
      }
      if (step % 3 != 2) triangulation.remove(near);
      if (step % 3 != 0) {
        Points more = ball(9000, 1.0, {}, 0.02, seed + 100 + random() % 100);
        std::erase_if(more, [&](const Point3& p) {
          return p[0] * on[0] + p[1] * on[1] + p[2] * on[2] < 0.975;
        });
        triangulation.insert(more, {});
      }
      triangulation.take_changes(changes);
      shape.update_nearby(triangulation, changes);
      Shape3<double> repeated;
      repeated.restore(triangulation);
      std::size_t kept = 0;
      for (const TetrahedronId t : triangulation.all_tetrahedra()) {
        wrong += shape.kept(t) != repeated.kept(t);
        kept += shape.kept(t);
        ++compared;
      }
      ASSERT_EQ(kept, shape.kept_count());
      const ShapeSurface surface = shape.surface(triangulation);
      ASSERT_TRUE(measure(surface.surface).closed);
      ASSERT_EQ(surface.vertices.size() + shape.lost_vertices().size(),
                triangulation.vertex_count());
    }
    EXPECT_LE(wrong, compared / 1000);
    // Occasionally the whole ball.
    Shape3<double> repeated;
    repeated.restore(triangulation);
    shape.restore(triangulation);
    EXPECT_EQ(shape.kept_tetrahedra(), repeated.kept_tetrahedra());
  }
}

TEST(PolesTest, NearbyUpdatesFollowAnySets) {
  for (const PointSet3 kind : kPointSets3) {
    SCOPED_TRACE(name(kind));
    Delaunay3<double> triangulation;
    triangulation.start_journal();
    Shape3<double> shape;
    shape.restore(triangulation);
    std::mt19937_64 random(6);
    Delaunay3<double>::Changes changes;
    const auto points = make_points3<double>(kind, kind == PointSet3::curves ? 40 : 250, 6);
    for (int step = 0; step < 40; ++step) {
      if (random() % 2 == 0) {
        const std::size_t begin = random() % points.size();
        triangulation.insert(
            std::span(points).subspan(begin, std::min<std::size_t>(30, points.size() - begin)), {});
      } else {
        std::vector<VertexId> some;
        for (const VertexId v : triangulation.all_vertices())
          if (random() % 8 == 0 || step % 20 == 19) some.push_back(v);
        triangulation.remove(some);
      }
      triangulation.take_changes(changes);
      shape.update_nearby(triangulation, changes);
      std::size_t kept = 0;
      for (const TetrahedronId t : triangulation.all_tetrahedra()) kept += shape.kept(t);
      ASSERT_EQ(kept, shape.kept_count());
      const ShapeSurface surface = shape.surface(triangulation);
      ASSERT_TRUE(measure(surface.surface).closed);
      if (triangulation.tetrahedron_count() > 0) {
        ASSERT_EQ(surface.vertices.size() + shape.lost_vertices().size(),
                  triangulation.vertex_count());
      }
    }
  }
}

TEST(PolesTest, ScalingByPowersOfTwoChangesNothing) {
  const Points points = ball(1500, 1.0, {3, 0, 0}, 0.02, 9);
  const RestoredSurface usual = restore_surface(points);
  for (const double scale : {0x1p-900, 0x1p-40, 0x1p1000}) {
    Points scaled = points;
    for (Point3& p : scaled)
      for (double& c : p) c *= scale;
    EXPECT_EQ(restore_surface(scaled).surface.faces, usual.surface.faces) << scale;
  }
}

}  // namespace
}  // namespace terrace::tri
