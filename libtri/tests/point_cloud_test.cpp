// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_cloud.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/view.hpp"
#include "view_world.hpp"

namespace terrace::tri::test {
namespace {

// Compares contents, hash and the journal's net changes with a map from slots to points.
TEST(PointCloud, BehavesLikeAMap) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    PointCloud set;
    std::map<VertexId, Point3> live_points, before;
    set.start_journal();
    for (int round = 0; round < 60; ++round) {
      if (random() % 3 != 0 || live_points.empty()) {
        std::vector<Point3> points(random() % 20);
        for (Point3& p : points) p = {double(random() % 4), double(random() % 4), 1.0};
        std::vector<PointCloud::Insertion> results(points.size());
        set.insert(points, results);
        for (std::size_t i = 0; i < points.size(); ++i) {
          EXPECT_TRUE(results[i].created);
          EXPECT_TRUE(live_points.emplace(results[i].vertex, points[i]).second);
        }
      } else {
        std::vector<VertexId> removed;
        for (const auto& [vertex, point] : live_points) {
          if (random() % 2 == 0) removed.push_back(vertex);
        }
        for (const VertexId vertex : removed) live_points.erase(vertex);
        set.remove(removed);
      }
      ASSERT_EQ(set.vertex_count(), live_points.size());
      std::map<VertexId, Point3> seen;
      PointCloud rebuilt;
      std::vector<Point3> points;
      for (const VertexId vertex : set.all_vertices()) {
        seen[vertex] = set.point(vertex);
        points.insert(points.begin(), set.point(vertex));
      }
      ASSERT_EQ(seen, live_points);
      rebuilt.build(points);
      EXPECT_EQ(rebuilt.hash(), set.hash());
      if (round % 5 != 0) continue;
      PointCloud::Changes changes;
      set.take_changes(changes);
      for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
        const auto at = before.find(changes.removed_vertices[i]);
        ASSERT_NE(at, before.end());
        EXPECT_EQ(at->second, changes.removed_points[i]);
        before.erase(at);
      }
      for (const VertexId vertex : changes.added_vertices) {
        ASSERT_TRUE(before.emplace(vertex, live_points.at(vertex)).second);
      }
      ASSERT_EQ(before, live_points);
    }
  }
}

TEST(PointCloud, RefusesPointsThatAreNotFinite) {
  PointCloud set;
  const std::vector<Point3> points{{0, 0, 0}, {0, 0, std::numeric_limits<double>::quiet_NaN()}};
  EXPECT_THROW(set.build(points), std::invalid_argument);
  EXPECT_EQ(set.vertex_count(), 0u);
}

// Under a view control the points must be those of the expanded clusters, each once, and a collapse
// must restore the same set.
TEST(PointCloud, HoldsThePointsOfTheExpandedClusters) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    World world(seed, kWorldShapes[0]);
    ViewControl<PointCloud> control(counts(world.source), load_root(world.source));
    const std::uint64_t start = control.model().triangulation().hash();
    const auto settle = [&](const View& view) {
      for (;;) {
        const auto& step = control.step(view);
        if (step.settled && step.wanted.empty()) break;
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          control.give(load(world.source, r));
        }
      }
    };
    View all;
    all.ground_error = 0.0;
    settle(all);
    std::vector<Point3> points;
    const auto take = [&](ClusterId id) {
      const auto& positions = world.source.at(id).positions;
      points.insert(points.end(), positions.begin(), positions.end());
    };
    take(cluster_id(world.source.top(), 0));
    for (const ClusterId id : control.model().expanded()) take(id);
    PointCloud expected;
    expected.build(points);
    EXPECT_EQ(control.model().triangulation().hash(), expected.hash());
    EXPECT_NE(expected.hash(), start);
    settle(View{});
    EXPECT_EQ(control.model().triangulation().hash(), start);
  }
}

}  // namespace
}  // namespace terrace::tri::test
