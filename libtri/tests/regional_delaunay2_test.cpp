// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/regional_delaunay2.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "metrics.hpp"
#include "points.hpp"
#include "view_world.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class RegionalDelaunay : public testing::Test {};
using RegionalCoords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(RegionalDelaunay, RegionalCoords);

/// The state of a renderer: the corners of triangles as they were when they were reported.
template <class Coord>
class DrawnTriangles {
 public:
  using T = RegionalDelaunay2<Coord>;

  explicit DrawnTriangles(const T& triangles) : triangles_(&triangles), drawn_(now()) {}
  void apply(const typename T::Changes& changes) {
    ASSERT_EQ(changes.removed_triangles.size(), changes.removed_corners.size());
    for (const TriangleId t : changes.removed_triangles) ASSERT_EQ(drawn_.erase(t), 1u);
    for (const TriangleId t : changes.added_triangles)
      ASSERT_TRUE(drawn_.emplace(t, corners(t)).second);
  }
  /// All triangles, and the triangles that the field requires, made by flips of the whole
  /// triangulation.
  void check() const {
    ASSERT_EQ(drawn_.size(), triangles_->triangle_count());
    ASSERT_EQ(drawn_, now());
    std::vector<Corners> shown, expected;
    for (const auto& [triangle, corners] : drawn_) shown.push_back(rotated(corners));
    for (const auto& vertices : metric_triangles(triangles_->plain(), triangles_->field()))
      expected.push_back(corners_of(triangles_->plain(), vertices));
    std::sort(shown.begin(), shown.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(shown, expected);
  }

 private:
  [[nodiscard]] Corners corners(TriangleId t) const {
    const auto vertices = triangles_->vertices(t);
    EXPECT_LT(vertices[0], vertices[1]);
    EXPECT_LT(vertices[0], vertices[2]);
    Corners result;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = triangles_->point(vertices[i]);
      result[i] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
    }
    return result;
  }
  [[nodiscard]] std::map<TriangleId, Corners> now() const {
    std::map<TriangleId, Corners> all;
    for (const TriangleId t : triangles_->all_triangles()) all.emplace(t, corners(t));
    return all;
  }
  const T* triangles_;
  std::map<TriangleId, Corners> drawn_;
};

/// The triangulation of all points at once has the same hash, so plain() is Delaunay.
template <class Coord>
std::uint64_t hash_at_once(const RegionalDelaunay2<Coord>& triangles) {
  std::vector<std::array<Coord, 2>> live_points;
  for (const VertexId v : triangles.all_vertices()) live_points.push_back(triangles.point(v));
  Delaunay2<Coord> rebuilt;
  rebuilt.build(live_points);
  return rebuilt.hash();
}

// Any points are added and removed, in one region or several, some in the slots of others. The
// deltas must be complete and minimal, and the triangles must be those of the whole triangulation
// flipped.
TYPED_TEST(RegionalDelaunay, FollowsChangesOfAnyPoints) {
  using Coord = TypeParam;
  using T = RegionalDelaunay2<Coord>;
  for (const PointSet kind : kPointSets) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(name(kind) + ", seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points<Coord>(kind, 200, seed);
      T triangles(seed == 3 ? MetricField2([](const PlanePoint&) { return ellipse_map(9, 1, 20); })
                            : three_regions(points));
      if (seed == 2) triangles.build(points);
      triangles.start_journal();
      DrawnTriangles<Coord> drawn(triangles);
      ASSERT_NO_FATAL_FAILURE(drawn.check());
      typename T::Changes changes;
      std::map<VertexId, typename T::Point> vertices;
      for (const VertexId v : triangles.all_vertices()) vertices[v] = triangles.point(v);
      for (int step = 0; step < 60; ++step) {
        if (random() % 2 == 0) {
          const std::size_t begin = random() % points.size();
          const auto some =
              std::span(points).subspan(begin, std::min<std::size_t>(30, points.size() - begin));
          std::vector<typename T::Insertion> results(random() % 2 * some.size());
          triangles.insert(some, results);
          for (std::size_t i = 0; i < results.size(); ++i)
            ASSERT_EQ(triangles.point(results[i].vertex), some[i]);
        } else {
          std::vector<VertexId> some;
          for (const VertexId v : triangles.all_vertices())
            if (random() % 8 == 0 || step % 20 == 19) some.push_back(v);
          triangles.remove(some);
        }
        if (random() % 4 == 0) triangles.follow();
        if (random() % 4 == 0) continue;  // several operations at once
        triangles.take_changes(changes);
        for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
          const auto gone = vertices.find(changes.removed_vertices[i]);
          ASSERT_NE(gone, vertices.end());
          ASSERT_EQ(gone->second, changes.removed_points[i]);
          vertices.erase(gone);
        }
        for (const VertexId v : changes.added_vertices)
          ASSERT_TRUE(vertices.emplace(v, triangles.point(v)).second);
        ASSERT_EQ(vertices.size(), triangles.vertex_count());
        ASSERT_NO_FATAL_FAILURE(drawn.apply(changes));
        ASSERT_NO_FATAL_FAILURE(drawn.check());
        ASSERT_EQ(triangles.plain().hash(), hash_at_once(triangles));
      }
    }
  }
}

// A triangle that is reported as removed and as added within one operation has a new corner.
TYPED_TEST(RegionalDelaunay, ReportsNetChanges) {
  using Coord = TypeParam;
  using T = RegionalDelaunay2<Coord>;
  auto points = make_points<Coord>(PointSet::uniform, 3000, 11);
  T triangles(three_regions(points));
  const auto last = std::span(points).last(100);
  triangles.build(std::span(points).first(2900));
  triangles.start_journal();
  typename T::Changes changes;
  std::vector<typename T::Insertion> inserted(1);
  std::size_t reported = 0;
  for (const auto& p : last) {
    triangles.insert({&p, 1}, inserted);
    for (const bool is_reverse : {false, true}) {
      if (is_reverse) triangles.remove(std::vector<VertexId>{inserted[0].vertex});
      triangles.take_changes(changes);
      reported += changes.added_triangles.size();
      std::set<std::array<VertexId, 3>> gone(changes.removed_corners.begin(),
                                             changes.removed_corners.end());
      for (const TriangleId t : changes.added_triangles)
        ASSERT_EQ(gone.count(triangles.vertices(t)), 0u);
    }
  }
  EXPECT_LT(reported, 100u * 40u);
  // Transient changes are not reported.
  std::vector<typename T::Insertion> insertions(100);
  triangles.insert(last, insertions);
  std::vector<VertexId> vertices;
  for (const auto& one : insertions) vertices.push_back(one.vertex);
  triangles.remove(vertices);
  triangles.take_changes(changes);
  EXPECT_TRUE(changes.added_vertices.empty() && changes.removed_vertices.empty());
  EXPECT_TRUE(changes.added_triangles.empty() && changes.removed_triangles.empty());
}

// An invalid metric, and a field that throws, must change nothing.
TYPED_TEST(RegionalDelaunay, RejectsInvalidMetrics) {
  using Coord = TypeParam;
  using T = RegionalDelaunay2<Coord>;
  const MetricField2 field([](const PlanePoint& p) {
    if (p[0] > 200) throw std::runtime_error("no map here");
    return p[0] > 100 ? LinearMap2{1, 1, 1, 1} : ellipse_map(3, 1, 0);
  });
  const std::vector<typename T::Point> good{{0, 0}, {10, 0}, {0, 10}, {10, 10}};
  const std::vector<typename T::Point> bad{{1, 1}, {150, 3}}, worse{{2, 2}, {250, 3}};
  T triangles(field);
  EXPECT_THROW(triangles.build(bad), std::invalid_argument);
  EXPECT_EQ(triangles.vertex_count(), 0u);
  triangles.build(good);
  EXPECT_THROW(triangles.insert(bad, {}), std::invalid_argument);
  EXPECT_THROW(triangles.insert(worse, {}), std::runtime_error);
  triangles.follow();
  EXPECT_EQ(triangles.vertex_count(), 4u);
  ASSERT_NO_FATAL_FAILURE(DrawnTriangles<Coord>(triangles).check());
}

// A view control over any points, interrupted or not, must end in the state that the rule demands,
// the deltas must add up, and the triangles must be those of the points at once.
TYPED_TEST(RegionalDelaunay, FollowsViews) {
  using Coord = TypeParam;
  using T = RegionalDelaunay2<Coord>;
  int mixed = 0;
  for (const Shape shape : kWorldShapes) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE("shape " + std::to_string(static_cast<int>(shape)) + " seed " +
                   std::to_string(seed));
      World world(seed, shape, 600);
      const WholeTree tree(world.source);
      const std::vector<PlanePoint> box{{world.box.min[0], world.box.min[1]},
                                        {world.box.max[0], world.box.max[1]}};
      ViewControl<T> control(counts(world.source), load_root(world.source), {}, three_regions(box));
      const T& triangles = control.model().triangulation();
      DrawnTriangles<Coord> drawn(triangles);
      for (int views = 0; views < 6; ++views) {
        const View view = world.view();
        const ClusterSet goal =
            wanted_by(tree, world.source, view, control.options(), expanded_set(control));
        for (int steps = 0;; ++steps) {
          ASSERT_LT(steps, 20000);
          StepBudget budget;
          if (seed % 2 == 0) budget.operations = 1 + below(world.random, 5);
          const auto& step = control.step(view, budget);
          ASSERT_NO_FATAL_FAILURE(drawn.apply(step.delta->changes));
          if (step.settled && step.wanted.empty()) break;
          for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
            control.give(load(world.source, r));
          }
        }
        ASSERT_NO_FATAL_FAILURE(drawn.check());
        ASSERT_EQ(expanded_set(control), goal);
        ASSERT_EQ(triangles.plain().hash(), hash_at_once(triangles));
        const auto& rest = control.restore();
        ASSERT_TRUE(rest.changes.added_triangles.empty());
        if (goal.size() > 3 && goal.size() + 3 < tree.parents.size()) ++mixed;
      }
    }
  }
  EXPECT_GT(mixed, 8) << "the views show everything or nothing";
}

// Regions of detail set by hand, and back to the start, also without deltas.
TYPED_TEST(RegionalDelaunay, ExpandsAndCollapsesRegionsOfDetail) {
  using Coord = TypeParam;
  using T = RegionalDelaunay2<Coord>;
  World world(3, Shape::random, 3000);
  const std::vector<PlanePoint> box{{world.box.min[0], world.box.min[1]},
                                    {world.box.max[0], world.box.max[1]}};
  MultiresolutionModel<T> model(world.source, {}, {}, three_regions(box));
  ModelOptions options;
  options.deltas = false;
  MultiresolutionModel<T> silent(world.source, {}, options, three_regions(box));
  DrawnTriangles<Coord> drawn(model.triangulation());
  const std::size_t coarse = model.point_count();
  Box3 half = world.box;
  half.max[0] = (half.min[0] + half.max[0]) / 2;
  const auto apply = [&](const auto& delta) {
    ASSERT_NO_FATAL_FAILURE(drawn.apply(delta.changes));
    ASSERT_NO_FATAL_FAILURE(drawn.check());
  };
  ASSERT_NO_FATAL_FAILURE(apply(model.refine(half, 0)));
  EXPECT_GT(model.point_count(), coarse);
  ASSERT_NO_FATAL_FAILURE(apply(model.coarsen(half, 1)));
  ASSERT_NO_FATAL_FAILURE(apply(model.set_level(0)));
  silent.set_level(0);
  ASSERT_NO_FATAL_FAILURE(DrawnTriangles<Coord>(silent.triangulation()).check());
  EXPECT_EQ(silent.triangulation().triangle_count(), model.triangulation().triangle_count());
  ASSERT_NO_FATAL_FAILURE(apply(model.set_level(Detail::kTop)));
  EXPECT_EQ(model.point_count(), coarse);
}

}  // namespace
}  // namespace terrace::tri::test
