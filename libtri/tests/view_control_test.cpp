// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "multiresolution_standin.hpp"
#include "terrace/tri/view.hpp"
#include "view_world.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class ViewControlOf : public testing::Test {};
using ViewTriangulations =
    testing::Types<StandIn<std::int32_t>, Delaunay2<std::int32_t>, Delaunay2<double>>;
TYPED_TEST_SUITE(ViewControlOf, ViewTriangulations);

#define TRACE(w)                                                       \
  SCOPED_TRACE(testing::Message() << "seed " << (w).seed << ", shape " \
                                  << static_cast<int>((w).shape))

ViewOptions random_options(World& world) {
  ViewOptions options;
  options.collapse_below = 0.3 + 0.7 * unit(world.random);
  options.guard = 0.2 * unit(world.random);
  options.ask_above = 0.2 + unit(world.random);
  return options;
}

// Wherever steps start, they must end in the state given by the recursive rule over the whole
// hierarchy.
TYPED_TEST(ViewControlOf, EndsInTheStateOfTheRule) {
  int mixed = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    for (const Shape shape : kWorldShapes) {
      World world(seed, shape);
      TRACE(world);
      const WholeTree tree(world.source);
      const ViewOptions options = random_options(world);
      ViewControl<TypeParam> control(counts(world.source), load_root(world.source), options);
      Consumer<TypeParam> consumer(control.model());
      for (int views = 0; views < 6; ++views) {
        SCOPED_TRACE(views);
        const View view = world.view();
        const ClusterSet goal = wanted_by(tree, world.source, view, options, expanded_set(control));
        for (;;) {
          const auto& step = control.step(view);
          ASSERT_NO_FATAL_FAILURE(consumer.apply(*step.delta, true));
          if (step.settled && step.wanted.empty()) break;
          ASSERT_EQ(step.pending + step.blocked, 0u);
          for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
            control.give(load(world.source, r));
          }
        }
        ASSERT_NO_FATAL_FAILURE(check_model(control.model(), world.source, goal));
        ASSERT_NO_FATAL_FAILURE(consumer.check());
        if (goal.size() > 3 && goal.size() + 3 < tree.parents.size()) ++mixed;
      }
    }
  }
  EXPECT_GT(mixed, 50) << "the views show everything or nothing";
}

// Bounds in place of records must lead to the same clusters, and records of clusters out of sight
// must never be requested.
TEST(ViewControl, RecordsMayComeLater) {
  using T = Delaunay2<std::int32_t>;
  std::size_t requested = 0, known_later = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    for (const Shape shape : kWorldShapes) {
      World world(seed, shape);
      TRACE(world);
      const WholeTree tree(world.source);
      const ViewOptions options = random_options(world);
      ViewControl<T> control(counts(world.source), load_root(world.source), options);
      ClusterSet bounded, read;
      const auto with_bounds = [&](LoadedCluster cluster) {
        const std::size_t level = level_of(cluster.cluster);
        for (std::size_t i = 0; i < cluster.child_records.size(); ++i) {
          ClusterRecord& record = cluster.child_records[i];
          if (below(world.random, 4) == 0) continue;
          // The last one belongs to the head.
          if (i < cluster.positions.size()) {
            bounded.insert(cluster_id(static_cast<unsigned>(level) - 1,
                                      cluster.children[i * level + level - 1]));
          }
          for (std::size_t k = 0; k < 3; ++k) {
            record.box.min[k] -= 3.0 * unit(world.random);
            record.box.max[k] += 3.0 * unit(world.random);
          }
          record.error = std::numeric_limits<double>::infinity();
          record.members = ClusterRecord::kUnread;
        }
        return cluster;
      };
      for (int views = 0; views < 4; ++views) {
        SCOPED_TRACE(views);
        const View view = world.view();
        const ClusterSet goal = wanted_by(tree, world.source, view, options, expanded_set(control));
        for (int steps = 0;; ++steps) {
          ASSERT_LT(steps, 5000);
          const auto& step = control.step(view);
          const std::vector<ViewRequest> wanted = step.wanted;
          if (step.settled && wanted.empty()) break;
          double least = std::numeric_limits<double>::infinity();
          for (const ViewRequest& r : wanted) {
            ASSERT_LE(r.importance, least);
            least = r.importance;
            if (r.members == ClusterRecord::kUnread) {
              control.give_record(r.cluster, world.source.at(r.cluster).record);
              if (bounded.count(r.cluster)) read.insert(r.cluster);
            } else {
              control.give(with_bounds(load(world.source, r)));
            }
          }
        }
        ASSERT_NO_FATAL_FAILURE(check_model(control.model(), world.source, goal));
      }
      control.give_record(cluster_id(0, 1u << 30), {});  // of a cluster that does not exist
      requested += read.size();
      known_later += bounded.size();
    }
  }
  EXPECT_GT(requested, 200u);
  EXPECT_LT(requested, known_later);
}

// However steps are interrupted, and in whatever portions clusters arrive, the triangulation must
// be valid in between and the end must be the same.
TEST(ViewControl, InterruptedStepsEndInTheSameState) {
  using T = Delaunay2<std::int32_t>;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const Shape shape : kWorldShapes) {
      World world(seed, shape);
      TRACE(world);
      const ViewOptions options = random_options(world);
      ViewControl<T> unlimited(counts(world.source), load_root(world.source), options);
      ViewControl<T> cut(counts(world.source), load_root(world.source), options);
      for (int views = 0; views < 4; ++views) {
        const View view = world.view();
        settle(unlimited, world.source, view);
        for (int steps = 0;; ++steps) {
          ASSERT_LT(steps, 20000);
          StepBudget budget;
          budget.operations = 1 + below(world.random, 3);
          const auto& step = cut.step(view, budget);
          ASSERT_LE(step.expanded + step.collapsed, budget.operations);
          ASSERT_EQ(find_fault(cut.model().triangulation()), "");
          if (step.settled && step.wanted.empty()) break;
          for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
            if (below(world.random, 3) != 0) cut.give(load(world.source, r));
          }
        }
        ASSERT_EQ(expanded_set(cut), expanded_set(unlimited));
        ASSERT_EQ(cut.model().triangulation().hash(), unlimited.model().triangulation().hash());
      }
    }
  }
}

// After any step a consumer of deltas must have the current state, even if a step both expands and
// collapses and if points share vertices.
TEST(ViewControl, DeltasAreComplete) {
  using T = StandIn<std::int32_t>;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    World world(seed, Shape::duplicates);
    TRACE(world);
    ViewOptions options = random_options(world);
    options.max_points = world.source.root().positions.size() + below(world.random, 150);
    ViewControl<T> control(counts(world.source), load_root(world.source), options);
    Consumer<T> consumer(control.model());
    for (int views = 0; views < 12; ++views) {
      const View view = world.view();
      for (int steps = 0; steps < 3; ++steps) {
        const auto& step = control.step(view);
        ASSERT_NO_FATAL_FAILURE(consumer.apply(*step.delta, true));
        ASSERT_NO_FATAL_FAILURE(consumer.check());
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          control.give(load(world.source, r));
        }
      }
    }
  }
}

Camera looking_down(double x, double y, double height) {
  return perspective_camera({{x, y, height}, {0, 0, -1}, {0, 1, 0}}, 60.0, 1.5, 1000.0);
}

// A camera that jitters by less than the band must change nothing, and one that goes away and comes
// back must find the same state.
TEST(ViewControl, JitterChangesNothing) {
  std::size_t expanded = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed, seed % 2 ? Shape::random : Shape::grid, 600);
    TRACE(world);
    ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
    const double height = world.box.max[2] + world.extent() * 0.3;
    View view;
    view.pixel_error = 20.0 + 100.0 * unit(world.random);
    const double x = world.box.min[0] + unit(world.random) * world.extent();
    const double y = world.box.min[1] + unit(world.random) * world.extent();
    // No box is nearer than this. The view turns by the same ratio.
    const double least = height - world.box.max[2];
    const double tremble = 0.02 * least;
    view.camera = looking_down(x, y, height);
    settle(control, world.source, view);
    expanded += control.model().expanded_count();
    // A cluster at the very edge may be added by the first few movements, and then stays.
    std::size_t collapsed = 0, after = 0;
    for (int frame = 0; frame < 200; ++frame) {
      const auto shake = [&] { return tremble * (unit(world.random) - 0.5); };
      view.camera = looking_down(x + shake(), y + shake(), height + shake());
      const auto& step = control.step(view);
      collapsed += step.collapsed;
      if (frame >= 150) after += step.expanded;
      for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
        control.give(load(world.source, r));
      }
    }
    EXPECT_EQ(collapsed, 0u);
    EXPECT_LE(after, 2u);
  }
  EXPECT_GT(expanded, 200u);
}

TEST(ViewControl, RestingCamerasSettle) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed, Shape::random, 600);
    TRACE(world);
    ViewOptions options;
    options.max_points = world.source.root().positions.size() + below(world.random, 400);
    ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source), options);
    for (int views = 0; views < 5; ++views) {
      const View view = world.view();
      settle(control, world.source, view);
      const std::uint64_t hash = control.model().triangulation().hash();
      for (int again = 0; again < 5; ++again) {
        const auto& step = control.step(view);
        ASSERT_TRUE(step.settled);
        ASSERT_EQ(step.expanded + step.collapsed, 0u);
        ASSERT_TRUE(step.delta->changes.added_triangles.empty());
        ASSERT_TRUE(step.requests.empty());
      }
      ASSERT_EQ(control.model().triangulation().hash(), hash);
    }
  }
}

// A missing cluster must be requested once. If it is forgotten, withdrawn or evicted from the
// cache, it must be requested again.
TEST(ViewControl, RequestsClustersOnce) {
  World world(7, Shape::random, 400);
  while (world.source.top() < 2 || world.source.levels[0].size() < 20) {
    world = World(world.seed + 1, Shape::random, 400);
  }
  TRACE(world);
  ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
  View close_view, none;
  close_view.ground_error = 0.0;
  std::set<ClusterId> requested;
  for (int steps = 0; steps < 300; ++steps) {
    const auto& step = control.step(close_view);
    for (const ViewRequest& r : step.requests) {
      EXPECT_TRUE(requested.insert(r.cluster).second) << to_string(r.cluster) << " twice";
    }
    EXPECT_TRUE(std::is_sorted(
        step.wanted.begin(), step.wanted.end(),
        [](const ViewRequest& a, const ViewRequest& b) { return a.importance > b.importance; }));
    for (const ViewRequest& r : step.wanted) EXPECT_TRUE(requested.count(r.cluster));
    EXPECT_TRUE(step.withdrawn.empty());
    if (step.wanted.empty()) break;
    // One at a time, the least important first.
    control.give(load(world.source, ViewRequest(step.wanted.back())));
  }
  std::set<ClusterId> useful;
  for (const auto& [id, parent] : WholeTree(world.source).parents) {
    if (world.source.at(id).record.error > 0.0) useful.insert(id);
  }
  EXPECT_EQ(requested, useful);

  // From the start again: requested, withdrawn, requested again, forgotten, requested again.
  ViewControl2<std::int32_t> other(counts(world.source), load_root(world.source));
  const std::size_t first = other.step(close_view).requests.size();
  ASSERT_GT(first, 0u);
  EXPECT_TRUE(other.step(close_view).requests.empty());
  EXPECT_EQ(other.step(none).withdrawn.size(), first);
  EXPECT_TRUE(other.step(none).withdrawn.empty());
  EXPECT_EQ(other.step(close_view).requests.size(), first);
  const ClusterId failed_cluster = other.step(close_view).wanted.front().cluster;
  other.forget(failed_cluster);
  ASSERT_EQ(other.step(close_view).requests.size(), 1u);
  EXPECT_EQ(other.step(close_view).wanted.front().cluster, failed_cluster);
}

TEST(ViewControl, PinsOverride) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed, Shape::random);
    TRACE(world);
    const WholeTree tree(world.source);
    ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
    View close_view, none;
    close_view.ground_error = 1e-3;
    settle(control, world.source, close_view);
    const ClusterSet all = expanded_set(control);
    if (all.empty()) continue;
    auto any = all.begin();
    std::advance(any, static_cast<std::ptrdiff_t>(below(world.random, all.size())));
    const ClusterId id = *any;

    control.pin(id, ViewControl2<std::int32_t>::Pin::expanded);
    settle(control, world.source, none);
    ClusterSet chain{id};
    for (auto it = tree.parents.find(id); tree.parents.count(it->second);) {
      chain.insert(it->second);
      it = tree.parents.find(it->second);
    }
    EXPECT_EQ(expanded_set(control), chain);

    control.pin(id, ViewControl2<std::int32_t>::Pin::collapsed);
    settle(control, world.source, close_view);
    ClusterSet remaining = all;
    std::erase_if(remaining, [&](ClusterId c) { return c == id || tree.is_below(c, id); });
    EXPECT_EQ(expanded_set(control), remaining);

    control.unpin(id);
    settle(control, world.source, close_view);
    EXPECT_EQ(expanded_set(control), all);
    settle(control, world.source, none);
    EXPECT_EQ(control.model().expanded_count(), 0u);
  }
}

TEST(ViewControl, PinnedFromTheStart) {
  World world(3, Shape::random);
  const std::vector<ClusterId> top = [&] {
    std::vector<ClusterId> ids;
    for (const auto& [id, parent] : WholeTree(world.source).parents) {
      if (level_of(id) + 1 == world.source.top()) ids.push_back(id);
    }
    return ids;
  }();
  ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
  control.pin(top[0], ViewControl2<std::int32_t>::Pin::expanded);
  settle(control, world.source, {});
  EXPECT_EQ(control.model().expanded(), std::vector<ClusterId>{top[0]});
}

// A cluster that contradicts itself must stay collapsed and be reported, and it can be given again.
TEST(ViewControl, ReportsFaultyClusters) {
  World world(5, Shape::random);
  ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
  View close_view;
  close_view.ground_error = 1e-3;
  const ViewRequest request = control.step(close_view).wanted.front();
  const LoadedCluster good = load(world.source, request);
  LoadedCluster bad = good;
  bad.positions.push_back({0, 0, 0});
  if (level_of(bad.cluster) > 0) {
    EXPECT_THROW(control.give(bad), HierarchyError) << "no child for the new member";
  }
  bad.children.resize(bad.children.size() + level_of(bad.cluster));
  if (level_of(bad.cluster) > 0) bad.child_records.emplace_back();
  EXPECT_TRUE(control.give(bad));
  const auto& step = control.step(close_view);
  ASSERT_EQ(step.faults.size(), 1u);
  EXPECT_EQ(step.faults[0].cluster, request.cluster);
  EXPECT_NE(step.faults[0].what.find("its record claims"), std::string::npos);
  EXPECT_FALSE(control.model().is_expanded(request.cluster));
  EXPECT_TRUE(control.step(close_view).faults.empty());
  for (const ViewRequest& r : control.step(close_view).wanted)
    EXPECT_NE(r.cluster, request.cluster);
  bad = good;
  if (!bad.positions.empty()) {
    bad.positions[0][0] = 0.5;
    control.give(bad);
    EXPECT_EQ(control.step(close_view).faults.size(), 1u);
  }
  control.give(good);
  control.step(close_view);
  EXPECT_TRUE(control.model().is_expanded(request.cluster));
  EXPECT_EQ(find_fault(control.model().triangulation()), "");
}

TEST(ViewControl, RejectsInvalidOptions) {
  World world(5, Shape::random);
  const auto make = [&](ViewOptions options) {
    ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source), options);
  };
  ViewOptions options;
  options.collapse_below = 0.0;
  EXPECT_THROW(make(options), std::invalid_argument);
  options = {};
  options.guard = std::nan("");
  EXPECT_THROW(make(options), std::invalid_argument);
  options = {};
  options.silhouette = 2.0;
  EXPECT_THROW(make(options), std::invalid_argument);

  ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source));
  View view;
  view.pixel_error = 0.0;
  EXPECT_THROW(control.step(view), std::invalid_argument);
  view = {};
  view.ground_error = std::nan("");
  EXPECT_THROW(control.step(view), std::invalid_argument);
  StepBudget budget;
  budget.seconds = 1.0;
  EXPECT_THROW(control.step({}, budget), std::invalid_argument);
  EXPECT_TRUE(control.step({}).settled);

  LoadedCluster not_root = load_root(world.source);
  not_root.cluster = cluster_id(0, 0);
  EXPECT_THROW((ViewControl2<std::int32_t>(counts(world.source), not_root)), HierarchyError);
  LoadedCluster above = load_root(world.source);
  above.cluster = cluster_id(world.source.top() + 1, 0);
  EXPECT_THROW(control.give(above), HierarchyError);
}

// Boxes and errors with NaN must neither crash nor add clusters that are not visible.
TEST(ViewControl, ToleratesHostileRecords) {
  const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity(), 1e308, -1.0};
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    World world(seed, Shape::random);
    TRACE(world);
    for (auto& level : world.source.levels) {
      for (auto& cluster : level) {
        if (below(world.random, 2)) {
          cluster.record.box.min[below(world.random, 3)] = bad[below(world.random, 5)];
        }
        if (below(world.random, 2)) {
          cluster.record.box.max[below(world.random, 3)] = bad[below(world.random, 5)];
        }
        if (below(world.random, 2)) cluster.record.error = bad[below(world.random, 5)];
      }
    }
    ViewOptions options;
    options.silhouette = seed % 2 ? 1.0 : 0.1;
    ViewControl2<std::int32_t> control(counts(world.source), load_root(world.source), options);
    for (int views = 0; views < 5; ++views) {
      settle(control, world.source, world.view());
      ASSERT_EQ(find_fault(control.model().triangulation()), "");
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
