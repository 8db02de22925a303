// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/multiresolution.hpp"

#include <gtest/gtest.h>

#include "multiresolution_hierarchy.hpp"
#include "multiresolution_oracle.hpp"
#include "multiresolution_standin.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class Multiresolution : public testing::Test {};

using Triangulations = testing::Types<StandIn<std::int32_t>, StandIn<double>,
                                      Delaunay2<std::int32_t>, Delaunay2<double>>;
TYPED_TEST_SUITE(Multiresolution, Triangulations);

constexpr Shape kShapes[] = {Shape::random, Shape::grid, Shape::duplicates, Shape::line,
                             Shape::one_place};

struct Case {
  std::uint64_t seed;
  Shape shape;
  std::mt19937_64 random;
  MemorySource source;
};

std::vector<Case> cases(std::uint64_t seeds) {
  std::vector<Case> result;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    for (const Shape shape : kShapes) {
      Case c{seed, shape, std::mt19937_64(seed), {}};
      const std::size_t count = 1 + below(c.random, 160);
      const unsigned levels = 1 + static_cast<unsigned>(below(c.random, 4));
      const double ratio = 2.0 + 6.0 * unit(c.random);
      c.source = make_hierarchy(make_points(shape, count, c.random), levels, ratio, c.random);
      result.push_back(std::move(c));
    }
  }
  return result;
}

#define TRACE_CASE(c)                                                  \
  SCOPED_TRACE(testing::Message() << "seed " << (c).seed << ", shape " \
                                  << static_cast<int>((c).shape))

// A box with corners among the hierarchy's own coordinates, so that it often just touches.
Box3 random_box(Case& c) {
  std::vector<Point3> places = c.source.root().positions;
  for (const auto& level : c.source.levels) {
    for (const auto& cluster : level) {
      places.insert(places.end(), cluster.positions.begin(), cluster.positions.end());
    }
  }
  const Point3 a = places[below(c.random, places.size())],
               b = places[below(c.random, places.size())];
  Box3 box;
  for (std::size_t k = 0; k < 3; ++k) {
    box.min[k] = std::min(a[k], b[k]);
    box.max[k] = std::max(a[k], b[k]);
  }
  if (below(c.random, 2)) box = box2(box.min[0], box.min[1], box.max[0], box.max[1]);
  return box;
}

Detail random_detail(Case& c) {
  Detail detail;
  detail.level = static_cast<unsigned>(below(c.random, c.source.top() + 2));
  const std::size_t count = below(c.random, 3);
  for (std::size_t i = 0; i < count; ++i) {
    detail.focuses.push_back(
        {random_box(c), static_cast<unsigned>(below(c.random, c.source.top() + 1))});
  }
  if (below(c.random, 2)) {
    const Box3 half = random_box(c);
    detail.needs = [half](std::size_t, const Box3& box) { return box.max[0] >= half.min[0]; };
  }
  return detail;
}

template <class T>
std::vector<ClusterId> expandable(const MultiresolutionModel<T>& model, MemorySource& source) {
  std::vector<ClusterId> found, children;
  std::vector<ClusterId> parents = model.expanded();
  parents.push_back(cluster_id(source.top(), 0));
  for (const ClusterId parent : parents) {
    model.children(parent, children);
    for (const ClusterId child : children) {
      EXPECT_NE(model.can_expand(child), model.is_expanded(child));
      if (model.can_expand(child)) found.push_back(child);
    }
  }
  return found;
}

// For any sequence of steps, the expanded set must agree with the step's definition, the model with
// the expanded set, and a consumer of deltas with the model.
TYPED_TEST(Multiresolution, EveryStepFollowsItsDefinition) {
  for (Case& c : cases(40)) {
    TRACE_CASE(c);
    const WholeTree tree(c.source);
    const Detail start = random_detail(c);
    MultiresolutionModel<TypeParam> model(c.source, start);
    ClusterSet expanded = wanted(tree, c.source, start);
    ASSERT_NO_FATAL_FAILURE(check_model(model, c.source, expanded));
    Consumer<TypeParam> consumer(model);
    for (int step = 0; step < 25; ++step) {
      SCOPED_TRACE(testing::Message() << "step " << step);
      const std::vector<ClusterId> closed = expandable(model, c.source), open = model.expanded();
      const unsigned level = static_cast<unsigned>(below(c.random, c.source.top() + 1));
      const typename MultiresolutionModel<TypeParam>::Delta* delta = nullptr;
      switch (below(c.random, 7)) {
        case 0:
        case 1: {
          if (closed.empty()) continue;
          const ClusterId id = closed[below(c.random, closed.size())];
          delta = &model.expand(id);
          expanded.insert(id);
          break;
        }
        case 2: {
          if (open.empty()) continue;
          const ClusterId id = open[below(c.random, open.size())];
          delta = &model.collapse(id);
          std::erase_if(expanded,
                        [&](ClusterId other) { return other == id || tree.is_below(other, id); });
          break;
        }
        case 3: {
          const Box3 box = random_box(c);
          delta = &model.refine(box, level);
          expanded = refined(tree, c.source, expanded, box, level);
          break;
        }
        case 4: {
          const Box3 box = random_box(c);
          delta = &model.coarsen(box, level);
          expanded = coarsened(tree, c.source, expanded, box, level);
          break;
        }
        case 5: {
          const Box3 box = random_box(c);
          delta = &model.set_region(box, level);
          expanded =
              coarsened(tree, c.source, refined(tree, c.source, expanded, box, level), box, level);
          break;
        }
        default: {
          const Detail detail = random_detail(c);
          delta = &model.set_detail(detail);
          expanded = wanted(tree, c.source, detail);
        }
      }
      ASSERT_NO_FATAL_FAILURE(check_model(model, c.source, expanded));
      ASSERT_NO_FATAL_FAILURE(consumer.apply(*delta));
      ASSERT_NO_FATAL_FAILURE(consumer.check());
    }
    ASSERT_EQ(c.source.announced.size(), c.source.was_read.size());
    ASSERT_EQ(c.source.announced, c.source.was_read);
  }
}

TYPED_TEST(Multiresolution, CollapseIsTheInverseOfExpand) {
  for (Case& c : cases(15)) {
    TRACE_CASE(c);
    MultiresolutionModel<TypeParam> model(c.source, random_detail(c));
    for (const ClusterId id : expandable(model, c.source)) {
      const std::uint64_t before = model.triangulation().hash();
      const std::size_t points = model.point_count();
      Consumer<TypeParam> consumer(model);
      consumer.apply(model.expand(id));
      ASSERT_EQ(model.point_count(), points + c.source.at(id).positions.size());
      consumer.apply(model.collapse(id));
      ASSERT_EQ(model.triangulation().hash(), before);
      ASSERT_EQ(model.point_count(), points);
      consumer.check();
    }
  }
}

// The order in which a set of clusters was expanded must not matter, nor other clusters expanded in
// between, nor whether points were built in bulk.
TYPED_TEST(Multiresolution, ResultDoesNotDependOnOrder) {
  for (Case& c : cases(15)) {
    TRACE_CASE(c);
    const WholeTree tree(c.source);
    const Detail goal = random_detail(c);
    MultiresolutionModel<TypeParam> at_once(c.source, goal);
    MultiresolutionModel<TypeParam> by_detour(c.source);
    by_detour.set_level(0);
    by_detour.set_detail(goal);
    MultiresolutionModel<TypeParam> one_by_one(c.source);
    const ClusterSet wanted_ids = wanted(tree, c.source, goal);
    for (;;) {
      std::vector<ClusterId> next = expandable(one_by_one, c.source);
      std::erase_if(next, [&](ClusterId id) { return !wanted_ids.count(id); });
      if (next.empty()) break;
      one_by_one.expand(next[below(c.random, next.size())]);
    }
    ASSERT_NO_FATAL_FAILURE(check_model(at_once, c.source, wanted_ids));
    ASSERT_NO_FATAL_FAILURE(check_model(by_detour, c.source, wanted_ids));
    ASSERT_NO_FATAL_FAILURE(check_model(one_by_one, c.source, wanted_ids));
  }
}

TYPED_TEST(Multiresolution, LevelZeroHasAllPointsAndTheTopOnlyTheRoot) {
  for (Case& c : cases(3)) {
    TRACE_CASE(c);
    const WholeTree tree(c.source);
    MultiresolutionModel<TypeParam> model(c.source);
    ASSERT_EQ(model.point_count(), c.source.root().positions.size());
    model.set_level(0);
    std::size_t all = 0;
    for (const auto& level : c.source.levels) {
      for (const auto& cluster : level) all += cluster.positions.size();
    }
    ASSERT_EQ(model.point_count(), all);
    ASSERT_EQ(model.expanded_count(), tree.parents.size());
    model.set_level(c.source.top());
    ASSERT_EQ(model.expanded_count(), 0u);
    model.set_level(200);
    ASSERT_EQ(model.expanded_count(), 0u);
  }
}

TYPED_TEST(Multiresolution, HeadsAgreeWithTheirClusters) {
  for (Case& c : cases(3)) {
    TRACE_CASE(c);
    MultiresolutionModel<TypeParam> model(c.source, {0, {}});
    std::vector<ClusterId> heads;
    for (const ClusterId id : model.expanded()) {
      model.heads(model.head_vertex(id), heads);
      ASSERT_NE(std::find(heads.begin(), heads.end(), id), heads.end());
      ASSERT_EQ(model.record(id).box, c.source.at(id).record.box);
    }
  }
}

TYPED_TEST(Multiresolution, RepeatedStepsChangeNothing) {
  std::mt19937_64 random(5);
  MemorySource source = make_hierarchy(make_points(Shape::random, 100, random), 2, 5.0, random);
  MultiresolutionModel<TypeParam> model(source);
  const ClusterId id = expandable(model, source).front();
  EXPECT_TRUE(model.collapse(id).changes.removed_vertices.empty());
  EXPECT_EQ(model.expand(id).changes.added_vertices.size(), source.at(id).positions.size());
  const auto& repeated = model.expand(id);
  EXPECT_TRUE(repeated.changes.added_vertices.empty());
  EXPECT_TRUE(repeated.changes.removed_triangles.empty());
  EXPECT_TRUE(repeated.changes.added_triangles.empty());
}

TYPED_TEST(Multiresolution, WithoutDeltasTheModelIsTheSame) {
  for (Case& c : cases(2)) {
    TRACE_CASE(c);
    const WholeTree tree(c.source);
    MultiresolutionModel<TypeParam> model(c.source, {}, {.deltas = false});
    const Detail detail = random_detail(c);
    EXPECT_TRUE(model.set_level(0).changes.added_vertices.empty());
    EXPECT_TRUE(model.set_detail(detail).changes.removed_vertices.empty());
    ASSERT_NO_FATAL_FAILURE(check_model(model, c.source, wanted(tree, c.source, detail)));
  }
}

// One step removes a vertex with one cluster and adds it again with another, possibly in its former
// slot. In both cases the consumer must learn the new height.
TYPED_TEST(Multiresolution, VertexMayChangeOwnersWithinAStep) {
  MemorySource source;
  source.levels.resize(2);
  const Box3 boxes[] = {box2(0, 0, 40, 40), box2(60, 0, 100, 40), box2(0, 60, 40, 100)};
  for (const double height : {1.0, 2.0, 3.0}) {
    MemorySource::Cluster cluster;
    cluster.positions = {{50, 50, height}};
    cluster.record = {boxes[source.levels[0].size()], 0.0, 1};
    source.levels[0].push_back(cluster);
  }
  source.levels[1].resize(1);
  source.root().positions = {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}};
  source.root().children = {0, 1, 2};

  MultiresolutionModel<TypeParam> model(source);
  Consumer<TypeParam> consumer(model);
  const WholeTree tree(source);
  for (const std::size_t c : {0u, 1u, 2u, 0u, 2u, 1u}) {
    const Detail detail{1, {{boxes[c], 0}}};
    consumer.apply(model.set_detail(detail));
    ASSERT_NO_FATAL_FAILURE(check_model(model, source, wanted(tree, source, detail)));
    ASSERT_NO_FATAL_FAILURE(consumer.check());
  }
}

// Roots with zero, one and two points; clusters without members; a single level.
TYPED_TEST(Multiresolution, HandlesTinyHierarchies) {
  for (const std::size_t count : {0u, 1u, 2u, 3u}) {
    SCOPED_TRACE(count);
    MemorySource source;
    MemorySource::Cluster root;
    for (std::size_t i = 0; i < count; ++i) {
      root.positions.push_back({static_cast<double>(i * i), static_cast<double>(i), 1.0});
    }
    source.levels = {{root}};
    MultiresolutionModel<TypeParam> model(source, {0, {}});
    ASSERT_NO_FATAL_FAILURE(check_model(model, source, {}));
    model.set_level(0);
    model.refine(box2(0, 0, 9, 9), 0);
    ASSERT_NO_FATAL_FAILURE(check_model(model, source, {}));

    // The same root above one level of clusters with zero or one member.
    MemorySource two;
    two.levels.resize(2);
    for (std::size_t i = 0; i < count; ++i) {
      root.children.push_back(i);
      MemorySource::Cluster cluster;
      const Point3 p = root.positions[i];
      Box3 box{p, p};
      if (i != 0) {
        cluster.positions.push_back({p[0] + 7, p[1] + 5, 2.0});
        box.max = cluster.positions[0];
      }
      cluster.record = {box, 9.0, cluster.positions.size()};
      two.levels[0].push_back(cluster);
    }
    two.levels[1].push_back(root);
    const WholeTree tree(two);
    MultiresolutionModel<TypeParam> small(two);
    Consumer<TypeParam> consumer(small);
    for (const Detail& detail :
         {Detail{0, {}}, Detail{1, {}}, Detail{1, {{box2(8, 6, 8, 6), 0}}}}) {
      consumer.apply(small.set_detail(detail));
      ASSERT_NO_FATAL_FAILURE(check_model(small, two, wanted(tree, two, detail)));
      consumer.check();
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
