// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/dynamic_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "ball_world.hpp"
#include "delaunay3/access.hpp"
#include "drawn_surface.hpp"
#include "points3.hpp"
#include "shape/nearby.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class DynamicSurfaceOf : public testing::Test {};
using SurfaceCoords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(DynamicSurfaceOf, SurfaceCoords);

// Any points are added and removed. The deltas must be complete, and the surface must equal the
// surface of a shape that follows the same changes. From scratch it must equal a new object's.
TYPED_TEST(DynamicSurfaceOf, FollowsChangesOfAnyPoints) {
  using Coord = TypeParam;
  for (const PointSet3 kind : kPointSets3) {
    SCOPED_TRACE(name(kind));
    std::mt19937_64 random(6);
    DynamicSurface<Coord> surface;
    const auto points = make_points3<Coord>(kind, kind == PointSet3::curves ? 40 : 250, 6);
    Delaunay3<Coord> triangulation;
    triangulation.start_journal();
    Shape3<Coord> shape;
    shape.restore(triangulation);
    Drawn<Coord> drawn(surface);
    typename DynamicSurface<Coord>::Changes changes;
    surface.start_journal();
    typename Delaunay3<Coord>::Changes tetrahedra;
    for (int step = 0; step < (TERRACE_TEST_SHARE == 1 ? 60 : 20); ++step) {
      // Both in the same way, so that handles are equal.
      if (random() % 2 == 0) {
        const std::size_t begin = random() % points.size();
        const auto some =
            std::span(points).subspan(begin, std::min<std::size_t>(30, points.size() - begin));
        surface.insert(some, {});
        triangulation.insert(some, {});
      } else {
        std::vector<VertexId> some;
        for (const VertexId v : surface.all_vertices())
          if (random() % 8 == 0 || step % 20 == 19) some.push_back(v);
        surface.remove(some);
        triangulation.remove(some);
      }
      if (random() % 4 == 0) continue;  // several operations at once
      triangulation.take_changes(tetrahedra);
      const bool scratch = random() % 4 == 0;
      if (scratch) {
        surface.restore(2);
        shape.restore(triangulation);
      } else {
        shape.update_nearby(triangulation, tetrahedra);
      }
      surface.take_changes(changes);
      const auto sorted = [](auto list) {
        std::sort(list.begin(), list.end());
        return list;
      };
      ASSERT_EQ(sorted(changes.added_vertices), sorted(tetrahedra.added_vertices));
      ASSERT_EQ(sorted(changes.removed_vertices), sorted(tetrahedra.removed_vertices));
      ASSERT_EQ(sorted(changes.removed_points), sorted(tetrahedra.removed_points));
      ASSERT_NO_FATAL_FAILURE(drawn.apply(changes));
      ASSERT_NO_FATAL_FAILURE(drawn.check());
      ASSERT_EQ(surface.tetrahedra().hash(), triangulation.hash());
      ASSERT_EQ(drawn.triangles(),
                faces_of(shape.surface_without_lids(triangulation), triangulation));
      // A triangle that is reported as removed and as added has a new corner.
      std::set<std::array<VertexId, 3>> last_corners(changes.removed_corners.begin(),
                                                     changes.removed_corners.end());
      for (const TriangleId t : changes.added_triangles) {
        const auto corners = surface.vertices(t);
        const bool is_new = std::any_of(corners.begin(), corners.end(), [&](VertexId v) {
          return std::count(changes.added_vertices.begin(), changes.added_vertices.end(), v) > 0;
        });
        ASSERT_TRUE(is_new || last_corners.count(corners) == 0);
      }
      if (!scratch) continue;
      std::vector<std::array<Coord, 3>> live_points;
      for (const VertexId v : surface.all_vertices()) live_points.push_back(surface.point(v));
      DynamicSurface<Coord> rebuilt;
      rebuilt.build(live_points);
      ASSERT_EQ(surface.hash(), rebuilt.hash());
    }
  }
}

// Half of the body is fine, half coarse. After large changes most tetrahedra are labelled without
// examining their surroundings.
TYPED_TEST(DynamicSurfaceOf, FollowsChangesNextToCoarseParts) {
  using Coord = TypeParam;
  std::mt19937_64 random(7);
  std::vector<std::array<Coord, 3>> fine, coarse;
  for (const Point3& p : bumpy_ball(12'000, random)) {
    auto& part = p[2] > 0x1p20 ? fine : coarse;
    if (&part == &coarse && coarse.size() >= 25) continue;
    part.push_back({static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
  }
  DynamicSurface<Coord> surface;
  Delaunay3<Coord> triangulation;
  coarse.insert(coarse.end(), fine.begin(), fine.end());
  surface.build(coarse);
  triangulation.build(coarse);
  surface.start_journal();
  triangulation.start_journal();
  Shape3<Coord> shape;
  shape.restore(triangulation);
  Drawn<Coord> drawn(surface);
  typename DynamicSurface<Coord>::Changes changes;
  typename Delaunay3<Coord>::Changes tetrahedra;
  std::size_t differing = 0, large = 0;
  std::array<double, 2> work{}, removed{};  // of the fine points, then of the coarse ones
  for (int step = 0; step < 12; ++step) {
    // Removes a fine patch, small or large, or a few of the coarse points, and adds it again.
    const bool use_coarse = step % 3 == 2;
    const double reach = step % 3 == 0 ? 0x1p16 : step % 3 == 1 ? 0x1p18 : 0x1p18;
    const auto middle = use_coarse ? coarse[random() % 25] : fine[random() % fine.size()];
    std::vector<VertexId> patch;
    std::vector<std::array<Coord, 3>> points;
    for (const VertexId v : surface.all_vertices()) {
      double square = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double d = static_cast<double>(surface.point(v)[k]) - static_cast<double>(middle[k]);
        square += d * d;
      }
      const bool is_coarse = !(surface.point(v)[2] > 0x1p20);
      if (square > reach * reach || is_coarse != use_coarse) continue;
      patch.push_back(v);
      points.push_back(surface.point(v));
    }
    work[use_coarse] += static_cast<double>(surface.removal_work(patch));
    removed[use_coarse] += static_cast<double>(patch.size());
    for (const bool is_reverse : {false, true}) {
      if (is_reverse) {
        surface.insert(points, {});
        triangulation.insert(points, {});
      } else {
        surface.remove(patch);
        triangulation.remove(patch);
      }
      surface.take_changes(changes);
      triangulation.take_changes(tetrahedra);
      shape.update_nearby(triangulation, tetrahedra);
      large += shape::reaches_far(tetrahedra) &&
               2 * tetrahedra.added_tetrahedra.size() < triangulation.tetrahedron_count();
      ASSERT_NO_FATAL_FAILURE(drawn.apply(changes));
      ASSERT_NO_FATAL_FAILURE(drawn.check());
      ASSERT_EQ(drawn.triangles(),
                faces_of(shape.surface_without_lids(triangulation), triangulation));
      const ShapeSurface found = shape.surface(triangulation);
      ASSERT_TRUE(measure(found.surface).closed);
      ASSERT_EQ(found.vertices.size() + shape.lost_vertices().size(), triangulation.vertex_count());
    }
    surface.restore();
    surface.take_changes(changes);
    ASSERT_NO_FATAL_FAILURE(drawn.apply(changes));
    differing += changes.removed_triangles.size();
    shape.restore(triangulation);
  }
  EXPECT_GT(large, 0u);
  // The estimate for a coarse point must exceed that for a fine one.
  EXPECT_GE(work[0], removed[0]);
  EXPECT_GT(work[1] / removed[1], 1.25 * work[0] / removed[0]);
  EXPECT_LE(differing, 12 * surface.triangle_count() / 1000);
}

// On a surface the estimated work equals the number of points. The middle of a body has tetrahedra
// with all of them.
TYPED_TEST(DynamicSurfaceOf, EstimatesCostlyRemovals) {
  using Coord = TypeParam;
  std::mt19937_64 random(8);
  std::vector<std::array<Coord, 3>> points;
  for (const Point3& p : bumpy_ball(2000, random))
    points.push_back(
        {static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
  DynamicSurface<Coord> surface;
  const std::vector<VertexId> vertices = surface.build(points);
  EXPECT_EQ(surface.removal_work({}), 0u);
  EXPECT_GE(surface.removal_work(vertices), vertices.size());
  EXPECT_LT(surface.removal_work(vertices), 3 * vertices.size());
  const Coord middle{1 << 20};
  std::vector<typename DynamicSurface<Coord>::Insertion> inserted(1);
  surface.insert(std::vector<std::array<Coord, 3>>{{middle, middle, middle}}, inserted);
  surface.follow();
  EXPECT_GT(surface.removal_work(std::vector<VertexId>{inserted[0].vertex}), 200u);
}

TYPED_TEST(DynamicSurfaceOf, OmitsTransientChanges) {
  using Coord = TypeParam;
  std::mt19937_64 random(5);
  std::vector<std::array<Coord, 3>> points;
  for (const Point3& p : bumpy_ball(2000, random))
    points.push_back(
        {static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
  DynamicSurface<Coord> surface;
  surface.build(std::span(points).first(1800));
  surface.start_journal();
  typename DynamicSurface<Coord>::Changes changes;
  std::vector<typename DynamicSurface<Coord>::Insertion> inserted(200);
  const std::uint64_t hash = surface.hash();
  surface.insert(std::span(points).last(200), inserted);
  std::vector<VertexId> vertices;
  for (const auto& one : inserted) vertices.push_back(one.vertex);
  surface.remove(vertices);
  surface.take_changes(changes);
  EXPECT_TRUE(changes.added_vertices.empty());
  EXPECT_TRUE(changes.removed_vertices.empty());
  EXPECT_TRUE(changes.added_triangles.empty());
  EXPECT_TRUE(changes.removed_triangles.empty());
  EXPECT_EQ(surface.hash(), hash);
}

/// Builds a surface at once from the points of a model.
template <class Coord>
DynamicSurface<Coord> build_at_once(const MultiresolutionModel<DynamicSurface<Coord>>& model) {
  std::vector<std::array<Coord, 3>> live_points;
  for (const VertexId v : model.triangulation().all_vertices())
    live_points.push_back(model.triangulation().point(v));
  DynamicSurface<Coord> surface;
  surface.build(live_points);
  return surface;
}

// A view control must end in the state that the rule demands, interrupted or not. The tetrahedra
// must be those built at once, the deltas must add up to the surface, and the surface from scratch
// must be the one built at once. If the time is too short for a cluster, it is removed point by
// point.
TYPED_TEST(DynamicSurfaceOf, FollowsViews) {
  using T = DynamicSurface<TypeParam>;
  int mixed = 0;
  std::size_t partly = 0;
  double time = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    World world = ball_world(seed, 600);
    const WholeTree tree(world.source);
    ViewControl<T> control(counts(world.source), load_root(world.source));
    const T& surface = control.model().triangulation();
    Drawn<TypeParam> drawn(surface);
    ASSERT_EQ(surface.hash(), build_at_once(control.model()).hash());
    for (int views = 0; views < 6; ++views) {
      const View view = world.view();
      const ClusterSet goal =
          wanted_by(tree, world.source, view, control.options(), expanded_set(control));
      for (int steps = 0;; ++steps) {
        ASSERT_LT(steps, 20000);
        StepBudget budget;
        if (seed % 2 == 0) budget.operations = 1 + below(world.random, 5);
        if (seed % 3 == 0) {
          budget.seconds = 1e-3;
          budget.clock = [&] { return time += 1e-3; };
        }
        const std::size_t before = control.model().point_count();
        const auto& step = control.step(view, budget);
        partly += step.collapsed == 0 && control.model().point_count() < before;
        ASSERT_NO_FATAL_FAILURE(drawn.apply(step.delta->changes));
        if (step.settled && step.wanted.empty()) break;
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          control.give(load(world.source, r));
        }
      }
      ASSERT_NO_FATAL_FAILURE(drawn.check());
      ASSERT_EQ(expanded_set(control), goal);
      ASSERT_EQ(find_fault(surface.tetrahedra()), "");
      const T rebuilt_model = build_at_once(control.model());
      ASSERT_EQ(surface.tetrahedra().hash(), rebuilt_model.tetrahedra().hash());
      const auto& rest = control.restore(1 + static_cast<unsigned>(below(world.random, 3)));
      ASSERT_TRUE(rest.changes.added_vertices.empty());
      ASSERT_TRUE(rest.reassigned.empty());
      ASSERT_NO_FATAL_FAILURE(drawn.apply(rest.changes));
      ASSERT_NO_FATAL_FAILURE(drawn.check());
      ASSERT_EQ(surface.hash(), rebuilt_model.hash());
      ASSERT_TRUE(control.restore().changes.added_triangles.empty());
      if (goal.size() > 3 && goal.size() + 3 < tree.parents.size()) ++mixed;
    }
  }
  EXPECT_GT(mixed, 8) << "the views show everything or nothing";
  EXPECT_GT(partly, 100u) << "all clusters were collapsed at once";
}

// Regions set by hand, and back to the start.
TYPED_TEST(DynamicSurfaceOf, FollowsRegions) {
  using Coord = TypeParam;
  World world = ball_world(3, 3000);
  MultiresolutionModel<DynamicSurface<Coord>> model(world.source);
  const std::uint64_t start = model.triangulation().hash();
  Drawn<Coord> drawn(model.triangulation());
  Box3 half = world.box;
  half.max[0] = 0x1p20;
  const auto apply = [&](const auto& delta) {
    ASSERT_NO_FATAL_FAILURE(drawn.apply(delta.changes));
    ASSERT_NO_FATAL_FAILURE(drawn.check());
    ASSERT_EQ(model.triangulation().tetrahedra().hash(), build_at_once(model).tetrahedra().hash());
  };
  ASSERT_NO_FATAL_FAILURE(apply(model.refine(half, 0)));
  EXPECT_GT(model.point_count(), 1200u);
  ASSERT_NO_FATAL_FAILURE(apply(model.coarsen(half, 1)));
  ASSERT_NO_FATAL_FAILURE(apply(model.set_region(half, 1)));
  ASSERT_NO_FATAL_FAILURE(apply(model.set_level(0)));
  EXPECT_EQ(model.point_count(), 3000u);
  ASSERT_NO_FATAL_FAILURE(apply(model.restore()));
  EXPECT_EQ(model.triangulation().hash(), build_at_once(model).hash());
  EXPECT_GT(model.triangulation().triangle_count(), 5900u);
  ModelOptions options;
  options.deltas = false;
  MultiresolutionModel<DynamicSurface<Coord>> silent(world.source, {}, options);
  ASSERT_TRUE(silent.set_level(0).changes.added_triangles.empty());
  silent.restore();
  EXPECT_EQ(silent.triangulation().hash(), model.triangulation().hash());
  ASSERT_NO_FATAL_FAILURE(apply(model.set_level(Detail::kTop)));
  ASSERT_NO_FATAL_FAILURE(apply(model.restore()));
  EXPECT_EQ(model.triangulation().hash(), start);
}

}  // namespace
}  // namespace terrace::tri::test
