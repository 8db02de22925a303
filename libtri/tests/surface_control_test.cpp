// SPDX-License-Identifier: Apache-2.0
// Checks the end state of steps against its definition, and errors by brute force.
#include "terrace/tri/surface_control.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "vertex_tree_world.hpp"

namespace terrace::tri {
namespace vertex_trees {
namespace {

class SurfaceControlTest : public testing::Test {
 protected:
  /// A tree takes longer to build than a test to run, so the tests share one.
  struct Built {
    Built() {
      add_torus(60, 40, 0.0, false, full);
      std::mt19937_64 random(7);
      tree = vertex_tree(full, random_clusters(full, 20, true, random));
    }
    Surface full;
    VertexTree tree;
  };
  static const Built& built() {
    static const Built once;
    return once;
  }

  static Camera camera(const Point3& from, const Point3& to, double pixels = 600.0) {
    return perspective_camera({.position = from,
                               .direction = {to[0] - from[0], to[1] - from[1], to[2] - from[2]},
                               .up = {0.1, 0.2, 1.0}},
                              45.0, 1.5, pixels);
  }
  static std::set<std::uint32_t> shown(const SurfaceControl& control) {
    std::set<std::uint32_t> out;
    for (const VertexId v : control.front().all_vertices()) out.insert(slot(v));
    return out;
  }
  /// Steps until nothing changes.
  static void settle(SurfaceControl& control, const View& view, std::size_t operations = 1000) {
    for (unsigned i = 0; !control.step(view, {.operations = operations}).settled; ++i) {
      ASSERT_LT(i, 10000U);
    }
  }
  void expect_a_surface(const SurfaceControl& control) const {
    std::vector<bool> active(full_.points.size());
    for (std::uint32_t v = 0; v < active.size(); ++v) {
      active[control.front().input()[v]] = control.front().alive(VertexId{v});
    }
    const SurfaceOfCut cut = surface_of_cut(full_, tree_.parents, active);
    EXPECT_EQ(control.front().triangle_count(), cut.surface.faces.size());
    EXPECT_TRUE(measure(cut.surface).closed);
  }

  const Surface& full_ = built().full;
  const VertexTree& tree_ = built().tree;
};

TEST_F(SurfaceControlTest, UniformErrorGivesTheCutByError) {
  SurfaceControl control(full_, tree_, {.collapse_below = 1.0});
  for (const double error : {0.3, 0.05, 0.01, 0.1, 1.0, 0.02}) {
    settle(control, {.ground_error = error});
    const std::vector<bool> cut = cut_by_error(tree_, error);
    for (std::uint32_t v = 0; v < cut.size(); ++v) {
      EXPECT_EQ(control.front().alive(VertexId{v}), cut[control.front().input()[v]]);
    }
  }
}

TEST_F(SurfaceControlTest, TheEndIsTheSameHoweverStepsAreInterrupted) {
  const Camera first = camera({9, 3, 4}, {0, 0, 0}), second = camera({-6, 1, 2}, {-4, 0, 0});
  std::vector<std::set<std::uint32_t>> ends;
  for (const std::size_t operations : {1U, 3U, 1000000U}) {
    SurfaceControl control(full_, tree_);
    settle(control, {.camera = first, .pixel_error = 1.0}, operations);
    expect_a_surface(control);
    ends.push_back(shown(control));
    // On the way to another view and back.
    for (int i = 0; i < 5; ++i) control.step({.camera = second}, {.operations = operations});
    expect_a_surface(control);
  }
  EXPECT_EQ(ends[0], ends[2]);
  EXPECT_EQ(ends[1], ends[2]);
  EXPECT_LT(ends[0].size(), full_.points.size());
}

TEST_F(SurfaceControlTest, HysteresisKeepsVerticesAWhile) {
  SurfaceControl control(full_, tree_, {.collapse_below = 0.5});
  settle(control, {.ground_error = 0.05});
  const auto before = shown(control);
  settle(control, {.ground_error = 0.09});
  EXPECT_EQ(shown(control), before);
  settle(control, {.ground_error = 0.2});
  EXPECT_LT(shown(control).size(), before.size());
}

TEST_F(SurfaceControlTest, NearerPartsAreFiner) {
  SurfaceControl control(full_, tree_);
  settle(control, {.camera = camera({8, 0, 1}, {0, 0, 0})});
  std::size_t near = 0, far = 0;
  for (const std::uint32_t v : shown(control)) {
    (control.front().point(VertexId{v})[0] > 0 ? near : far) += 1;
  }
  EXPECT_GT(near, far + far / 2);
  // Looking away, only what is in every cut and what hysteresis keeps is left.
  settle(control, {.camera = camera({8, 0, 1}, {20, 0, 1})});
  EXPECT_LT(shown(control).size(), near / 2);
}

TEST_F(SurfaceControlTest, KeepsToTheLimitOfPoints) {
  const View near{.camera = camera({6, 0, 1}, {4, 0, 0}), .pixel_error = 0.01};
  for (const std::size_t most : {0U, 1U, 100U, 500U}) {
    SCOPED_TRACE(most);
    std::vector<std::set<std::uint32_t>> ends;
    for (const std::size_t operations : {2U, 100000U}) {
      SurfaceControl control(full_, tree_, {.max_points = most});
      const std::size_t limit = std::max(most, control.front().vertex_count());
      for (unsigned i = 0; !control.step(near, {.operations = operations}).settled; ++i) {
        ASSERT_LT(i, 10000U);
        EXPECT_LE(control.front().vertex_count(), limit);
      }
      EXPECT_GT(control.step(near).blocked, 0U);
      EXPECT_GT(control.step(near).worst, 1.0);
      expect_a_surface(control);
      ends.push_back(shown(control));
      // A focus without bounds wants all vertices alike.
      settle(control, {.focuses = {{{{-99, -99, -99}, {99, 99, 99}}, 0}}});
      EXPECT_LE(control.front().vertex_count(), limit);
      EXPECT_GE(control.front().vertex_count() + 30, limit);
      expect_a_surface(control);
    }
    EXPECT_EQ(ends[0], ends[1]);
  }
}

TEST_F(SurfaceControlTest, FocusesShowTheirLevel) {
  SurfaceControl control(full_, tree_);
  const Box3 box{{2, -3, -3}, {9, 3, 3}};
  settle(control, {.focuses = {{box, 1}}});
  for (std::uint32_t v = 0; v < full_.points.size(); ++v) {
    const std::uint32_t input = control.front().input()[v];
    if (tree_.levels[input] >= 1 && box.contains(full_.points[input])) {
      EXPECT_TRUE(control.front().alive(VertexId{v}));
    }
  }
  settle(control, {.focuses = {{box, 0}}});
  for (std::uint32_t v = 0; v < full_.points.size(); ++v) {
    if (box.contains(full_.points[control.front().input()[v]])) {
      EXPECT_TRUE(control.front().alive(VertexId{v}));
    }
  }
  EXPECT_LT(control.front().vertex_count(), full_.points.size());
  expect_a_surface(control);
}

TEST_F(SurfaceControlTest, PinsOverrideTheView) {
  SurfaceControl control(full_, tree_);
  const View coarse{.ground_error = 0.5};
  settle(control, coarse);
  const auto before = shown(control);
  std::vector<VertexId> fine;
  for (std::uint32_t v = 0; v < full_.points.size(); v += 40) fine.push_back(VertexId{v});
  control.pin(fine, {});
  settle(control, coarse);
  for (VertexId v : fine) {
    for (; v != kNoVertex; v = control.front().parent(v)) EXPECT_TRUE(control.front().alive(v));
  }
  expect_a_surface(control);
  // Everything below a vertex, although the view and the other pins want it.
  VertexId root{0};
  while (control.front().end_of_descendants(root) < slot(root) + 20)
    root = VertexId{slot(root) + 1};
  const VertexId below{slot(root) + 1};
  control.pin(fine, std::array{below});
  settle(control, {.ground_error = 0.0});
  for (std::uint32_t v = 0; v < full_.points.size(); ++v) {
    EXPECT_EQ(control.front().alive(VertexId{v}),
              v < slot(below) || v >= control.front().end_of_descendants(below));
  }
  expect_a_surface(control);
  control.pin({}, {});
  settle(control, {.ground_error = 0.9});
  settle(control, coarse);
  EXPECT_EQ(shown(control), before);
}

TEST_F(SurfaceControlTest, StopsWhenTheTimeIsSpent) {
  SurfaceControl control(full_, tree_);
  double now = 0.0;
  const View view{.ground_error = 0.0};
  const auto& first = control.step(view, {.seconds = 1.0, .clock = [&] { return now += 0.4; }});
  EXPECT_GT(first.activated, 0U);
  EXPECT_GT(first.pending, 0U);
  EXPECT_GT(first.worst, 1.0);
  EXPECT_FALSE(first.settled);
  settle(control, view);
  EXPECT_EQ(control.front().vertex_count(), full_.points.size());
}

TEST_F(SurfaceControlTest, RefusesBadInput) {
  EXPECT_THROW(SurfaceControl(full_, tree_, {.collapse_below = 0.0}), std::invalid_argument);
  VertexTree tree = tree_;
  tree.errors.pop_back();
  EXPECT_THROW(SurfaceControl(full_, tree), std::invalid_argument);
  SurfaceControl control(full_, tree_);
  EXPECT_THROW(control.step({.ground_error = -1.0}), std::invalid_argument);
  EXPECT_THROW(control.step({}, {.seconds = 1.0}), std::invalid_argument);
  EXPECT_TRUE(SurfaceControl({}, {}).step({}).settled);
}

}  // namespace
}  // namespace vertex_trees
}  // namespace terrace::tri
