// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "view/cache.hpp"
#include "view_world.hpp"

namespace terrace::tri::test {
namespace {

using Control = ViewControl2<std::int32_t>;

#define TRACE(w)                                                       \
  SCOPED_TRACE(testing::Message() << "seed " << (w).seed << ", shape " \
                                  << static_cast<int>((w).shape))

// Neither memory budget may ever be exceeded, and the view must still come as close as they allow:
// clusters that stay collapsed for lack of room would only fit at the cost of others of about the
// same importance.
TEST(ViewBudget, MemoryIsNeverExceeded) {
  std::size_t full = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    World world(seed, kWorldShapes[seed % 5], 500);
    TRACE(world);
    const WholeTree tree(world.source);
    ViewOptions options;
    const std::size_t root = world.source.root().positions.size();
    options.max_points = root + below(world.random, 200);
    options.max_cached_bytes = 3000 + below(world.random, 40000);
    Control control(counts(world.source), load_root(world.source), options);
    for (int views = 0; views < 8; ++views) {
      const View view = world.view();
      for (int steps = 0;; ++steps) {
        ASSERT_LT(steps, 5000);
        StepBudget budget;
        if (below(world.random, 2)) budget.operations = 1 + below(world.random, 5);
        const auto& step = control.step(view, budget);
        ASSERT_LE(control.model().point_count(), std::max(root, options.max_points));
        ASSERT_LE(control.cached_bytes(), options.max_cached_bytes);
        ASSERT_EQ(find_fault(control.model().triangulation()), "");
        if (step.settled && step.wanted.empty()) {
          full += step.blocked > 0;
          break;
        }
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          if (below(world.random, 4) == 0) continue;
          ASSERT_TRUE(control.give(load(world.source, r)));
          ASSERT_LE(control.cached_bytes(), options.max_cached_bytes);
        }
      }
      // No blocked cluster that the cache could hold may have room, and for the first one too few
      // points may be less important.
      const auto demands = all_demands(tree, world.source, view, options);
      const ClusterSet open = expanded_set(control);
      const std::size_t points = control.model().point_count();
      const std::size_t room = options.max_points - std::min(options.max_points, points);
      std::optional<ClusterId> first;
      for (const auto& [id, d] : demands) {
        const std::size_t members = world.source.at(id).positions.size();
        if (d.want <= 1.0 || !control.model().can_expand(id)) continue;
        if (ViewCache({}).bytes_of(level_of(id), members) >
            static_cast<double>(options.max_cached_bytes)) {
          continue;
        }
        ASSERT_LT(room, members) << to_string(id) << " has room";
        if (!first || d.want > demands.at(*first).want) first = id;
      }
      if (!first) continue;
      std::size_t remaining = room;
      for (const ClusterId other : open) {
        if (demands.at(other).keep < 0.999 * options.collapse_below * demands.at(*first).want) {
          remaining += world.source.at(other).positions.size();
        }
      }
      ASSERT_LT(remaining, world.source.at(*first).positions.size()) << to_string(*first);
    }
  }
  EXPECT_GT(full, 50u);
}

// Under a limit of points, interrupted steps must end where complete ones do.
TEST(ViewBudget, InterruptionsDoNotMatterUnderALimitOfPoints) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    World world(seed, kWorldShapes[seed % 3], 500);
    TRACE(world);
    ViewOptions options;
    options.max_points = world.source.root().positions.size() + below(world.random, 200);
    Control unlimited(counts(world.source), load_root(world.source), options);
    Control cut(counts(world.source), load_root(world.source), options);
    // Everything is given beforehand, so that both see the same clusters.
    for (const auto& [id, parent] : WholeTree(world.source).parents) {
      ViewRequest request{id, {}, 0, 0.0};
      for (const auto& [child, above] : WholeTree(world.source).parents) {
        // The last child of a cluster, in no particular order. The head's child is the one that no
        // member heads.
        if (above != id) continue;
        const auto& cluster = world.source.at(id);
        bool member = false;
        for (std::size_t i = 0; i < cluster.positions.size(); ++i) {
          const std::size_t level = level_of(id);
          member = member || cluster.children[i * level + level - 1] == ordinal_of(child);
        }
        if (!member) request.head_child = child;
      }
      ASSERT_TRUE(unlimited.give(load(world.source, request)));
      ASSERT_TRUE(cut.give(load(world.source, request)));
    }
    for (int views = 0; views < 6; ++views) {
      const View view = world.view();
      settle(unlimited, world.source, view);
      StepBudget budget;
      budget.operations = 1 + below(world.random, 2);
      settle(cut, world.source, view, budget);
      ASSERT_EQ(expanded_set(cut), expanded_set(unlimited));
    }
  }
}

// A cluster evicted from the cache must be requested again when it is wanted again.
TEST(ViewBudget, RequestsEvictedClustersAgain) {
  World world(11, Shape::random, 500);
  while (world.source.levels[0].size() < 30 || world.source.top() > 2) {
    world = World(world.seed + 1, Shape::random, 500);
  }
  TRACE(world);
  ViewOptions options;
  options.max_cached_bytes = 8000;  // a few clusters
  Control control(counts(world.source), load_root(world.source), options);
  View close_view;
  close_view.ground_error = 1e-3;
  std::set<ClusterId> requested, requested_twice;
  const auto run = [&](const View& view, std::set<ClusterId>& ids) {
    for (;;) {
      const auto& step = control.step(view);
      for (const ViewRequest& r : step.requests) ids.insert(r.cluster);
      const std::vector<ViewRequest> wanted = step.wanted;
      if (step.settled && wanted.empty()) return;
      for (const ViewRequest& r : wanted) control.give(load(world.source, r));
    }
  };
  run(close_view, requested);
  EXPECT_EQ(expanded_set(control), requested);
  run({}, requested_twice);
  EXPECT_TRUE(requested_twice.empty());
  EXPECT_EQ(control.model().expanded_count(), 0u);
  run(close_view, requested_twice);
  EXPECT_EQ(expanded_set(control), requested);
  EXPECT_GT(requested_twice.size(), requested.size() / 2);
  EXPECT_LT(requested_twice.size(), requested.size()) << "nothing was kept";
}

TEST(ViewBudget, RequestsNothingTwiceIfThereIsRoom) {
  World world(11, Shape::random, 500);
  Control control(counts(world.source), load_root(world.source));
  View close_view;
  close_view.ground_error = 1e-3;
  settle(control, world.source, close_view);
  settle(control, world.source, {});
  for (;;) {
    const auto& step = control.step(close_view);
    ASSERT_TRUE(step.requests.empty());
    if (step.settled) break;
  }
}

// A cluster larger than the whole budget must be neither requested nor accepted.
TEST(ViewBudget, RejectsClustersLargerThanTheCache) {
  World world(2, Shape::random, 400);
  ViewOptions options;
  options.max_cached_bytes = 100;
  Control control(counts(world.source), load_root(world.source), options);
  View close_view;
  close_view.ground_error = 1e-3;
  const auto& step = control.step(close_view);
  EXPECT_TRUE(step.wanted.empty());
  EXPECT_GT(step.blocked, 0u);
  EXPECT_GT(step.worst, 1.0);
  EXPECT_TRUE(step.settled);
  Control other(counts(world.source), load_root(world.source));
  EXPECT_FALSE(control.give(load(world.source, other.step(close_view).wanted.front())));
  EXPECT_EQ(control.cached_bytes(), 0u);
}

// The clock advances by 1 ms at each reading. A step must end in time, except for its first
// operation and for readings of the clock that no earlier step has needed, and everything must be
// done in the end. Without a time limit the clock must not be read.
TEST(ViewBudget, KeepsTheTimeLimit) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    World world(seed, Shape::random, 500);
    TRACE(world);
    Control timed(counts(world.source), load_root(world.source));
    Control free(counts(world.source), load_root(world.source));
    double time = 0.0;
    StepBudget budget;
    budget.clock = [&] { return time += 0.001; };
    for (int views = 0; views < 5; ++views) {
      const View view = world.view();
      settle(free, world.source, view, budget.seconds < 1.0 ? StepBudget{} : budget);
      StepBudget limited = budget;
      limited.seconds = 0.008;
      for (int steps = 0;; ++steps) {
        ASSERT_LT(steps, 5000);
        const double before = time;
        const auto& step = timed.step(view, limited);
        const double took = time - before;
        if (step.expanded + step.collapsed > 1) {
          ASSERT_LE(took, 0.0125);
        }
        if (step.settled && step.wanted.empty()) break;
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          timed.give(load(world.source, r));
        }
      }
      ASSERT_EQ(expanded_set(timed), expanded_set(free));
    }
    const double before = time;
    free.step({}, budget);
    ASSERT_EQ(time, before);
  }
}

// One stall of the clock must not slow down later steps forever.
TEST(ViewBudget, RecoversFromAStall) {
  World world(3, Shape::random, 2000);
  while (world.source.levels[0].size() < 40) world = World(world.seed + 1, Shape::random, 2000);
  Control control(counts(world.source), load_root(world.source));
  double time = 0.0, tick = 1e-5;
  StepBudget budget;
  budget.seconds = 0.01;
  budget.clock = [&] { return time += tick; };
  View close_view, none;
  close_view.ground_error = 1e-3;
  settle(control, world.source, close_view, budget);
  settle(control, world.source, none, budget);
  tick = 1.0;
  control.step(close_view, budget);
  control.step(none, budget);
  tick = 1e-5;
  EXPECT_LT(settle(control, world.source, close_view, budget), 60);
}

// For outlines: the same view with a smaller error for clusters that may show one.
TEST(ViewSilhouette, RefinesWhereAnOutlineMayShow) {
  std::size_t more = 0, rightly = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed, Shape::random, 600);
    TRACE(world);
    View view;
    view.camera = world.camera();
    view.pixel_error = 300.0;
    std::set<ClusterId> requested;
    ViewOptions plain, none, all, half;
    none.silhouette = all.silhouette = half.silhouette = 0.2;
    const bool perspective = view.camera->perspective;
    none.cone = [&](ClusterId, const ClusterRecord&) {
      // Faces the camera, so that no normal is perpendicular to a line of sight within the picture.
      NormalCone cone{view.camera->direction, 1.0};
      return perspective ? NormalCone{{0, 0, 1}, 0.0} : cone;
    };
    all.cone = [](ClusterId, const ClusterRecord&) { return NormalCone{{0, 0, 1}, 180.0}; };
    half.cone = [&](ClusterId id, const ClusterRecord& record) {
      EXPECT_TRUE(requested.insert(id).second) << "requested twice";
      EXPECT_EQ(record.members, world.source.at(id).positions.size());
      return NormalCone{{0, 0, 1}, ordinal_of(id) % 2 ? 180.0 : 0.0};
    };
    const auto run = [&](const ViewOptions& options, const View& v) {
      Control control(counts(world.source), load_root(world.source), options);
      settle(control, world.source, v);
      return expanded_set(control);
    };
    View finer = view;
    finer.pixel_error *= 0.2;
    const ClusterSet base = run(plain, view), finest = run(plain, finer);
    EXPECT_EQ(run(all, view), finest);
    const ClusterSet some = run(half, view), few = run(none, view);
    EXPECT_TRUE(std::includes(some.begin(), some.end(), base.begin(), base.end()));
    EXPECT_TRUE(std::includes(finest.begin(), finest.end(), some.begin(), some.end()));
    if (!perspective) {
      EXPECT_EQ(few, base);
    }
    for (const ClusterId id : some) {
      if (base.count(id)) continue;
      ++more;
      rightly += ordinal_of(id) % 2;
    }
  }
  EXPECT_GT(more, 20u);
  EXPECT_GE(rightly * 2, more);
}

}  // namespace
}  // namespace terrace::tri::test
