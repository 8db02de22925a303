// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "multiresolution_hierarchy.hpp"
#include "multiresolution_oracle.hpp"
#include "multiresolution_standin.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri::test {
namespace {

using StandInModel = MultiresolutionModel<StandIn<std::int32_t>>;

MemorySource good_source(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return make_hierarchy(make_points(Shape::duplicates, 150, random), 3, 4.0, random);
}

// Wherever in a step the source fails, the model must be unchanged and the next step must work.
TEST(MultiresolutionFailure, LeavesTheModelUnchanged) {
  const Detail details[] = {{0, {}},
                            {3, {}},
                            {2, {{box2(0, 0, 5, 5), 0}}},
                            {3, {{box2(4, 4, 9, 9), 0}, {box2(0, 0, 3, 3), 1}}}};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const Detail& before : details) {
      for (const Detail& after : details) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        MemorySource source = good_source(seed);
        const WholeTree tree(source);
        StandInModel model(source, before);
        Consumer<StandIn<std::int32_t>> consumer(model);
        std::size_t failures = 0;
        for (std::size_t lives = 0;; lives += 1 + lives / 2) {
          source.lives = lives;
          try {
            consumer.apply(model.set_detail(after));
            break;
          } catch (const SourceFailure&) {
            ++failures;
          }
          source.lives = std::numeric_limits<std::size_t>::max();
          ASSERT_NO_FATAL_FAILURE(check_model(model, source, wanted(tree, source, before)));
          ASSERT_NO_FATAL_FAILURE(consumer.check());
        }
        source.lives = std::numeric_limits<std::size_t>::max();
        ASSERT_NO_FATAL_FAILURE(check_model(model, source, wanted(tree, source, after)));
        ASSERT_NO_FATAL_FAILURE(consumer.check());
        if (after.level == 0 && before.level != 0) {
          ASSERT_GT(failures, 0u);
        }
      }
    }
  }
}

TEST(MultiresolutionFailure, LeavesNothingBehindInTheConstructor) {
  for (std::size_t lives = 0; lives < 30; ++lives) {
    MemorySource source = good_source(3);
    source.lives = lives;
    EXPECT_THROW(StandInModel(source, {0, {}}), SourceFailure);
  }
}

// Corrupts one cluster of an otherwise good source, and expects a step into it to fail with the
// message, whether the cluster comes first or last in the step.
void expect_refused(const std::function<void(MemorySource&, ClusterId)>& spoil, unsigned level,
                    const std::string& message) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    MemorySource source = good_source(seed);
    const WholeTree tree(source);
    // The corrupted cluster needs at least two members, so that these can contradict each other.
    std::uint64_t ordinal = 0;
    while (source.levels[level][ordinal].positions.size() < 2) ++ordinal;
    const ClusterId id = cluster_id(level, ordinal);
    const MemorySource valid = source;
    StandInModel model(source);
    spoil(source, id);
    try {
      model.set_level(0);
      ADD_FAILURE() << "no error";
    } catch (const HierarchyError& error) {
      EXPECT_EQ(level_of(error.cluster()), level) << error.what();
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
    const std::vector<ClusterId> none = model.expanded();
    EXPECT_TRUE(none.empty());
    source.levels = valid.levels;
    ASSERT_NO_FATAL_FAILURE(check_model(model, source, {}));
    // The failure must leave nothing behind.
    ASSERT_NO_THROW(model.set_level(0));
    ASSERT_NO_FATAL_FAILURE(check_model(model, source, wanted(tree, source, {0, {}})));
  }
}

TEST(MultiresolutionHostile, RejectsOrdinalsOutOfRange) {
  expect_refused(
      [](MemorySource& s, ClusterId id) { s.at(id).children.back() = s.levels[0].size(); }, 1,
      "which has");
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).children[1] = ~std::uint64_t{0}; }, 2,
                 "heads cluster 18446744073709551615 of level 1");
}

TEST(MultiresolutionHostile, RejectsContradictoryCounts) {
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).positions.pop_back(); }, 0,
                 "its record claims");
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).children.pop_back(); }, 1,
                 "child ordinals");
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).children.push_back(0); }, 0,
                 "child ordinals");
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).record.members = ~std::uint64_t{0}; },
                 0, "its record claims 18446744073709551615 members");
}

// A tree cannot have cycles, as levels decrease. What can occur is a cluster with two heads.
TEST(MultiresolutionHostile, RejectsClustersWithTwoHeads) {
  expect_refused([](MemorySource& s, ClusterId id) { s.at(id).children[1] = s.at(id).children[0]; },
                 1, "heads as well");
  expect_refused(
      [](MemorySource& s, ClusterId id) {
        // A member claims the cluster that the head of its own cluster heads.
        const WholeTree tree(s);
        std::vector<std::uint64_t> members;
        for (std::size_t i = 0; i < s.at(id).positions.size(); ++i) {
          members.push_back(s.at(id).children[2 * i + 1]);
        }
        for (const auto& [child, parent] : tree.parents) {
          if (parent == id &&
              std::find(members.begin(), members.end(), ordinal_of(child)) == members.end()) {
            s.at(id).children[1] = ordinal_of(child);
          }
        }
      },
      2, "heads as well");
}

TEST(MultiresolutionHostile, RejectsCoordinatesThatTheTriangulationCannotHold) {
  for (const double bad :
       {-1.0, 0.5, 1073741824.0, 1e300, std::nan(""), std::numeric_limits<double>::infinity()}) {
    SCOPED_TRACE(bad);
    expect_refused([bad](MemorySource& s, ClusterId id) { s.at(id).positions[1][1] = bad; }, 0,
                   "member 1 is at");
  }
  MemorySource source = good_source(1);
  source.at(cluster_id(0, 0)).positions.assign(1, {0.0, std::nan(""), 0.0});
  source.at(cluster_id(0, 0)).record.members = 1;
  MultiresolutionModel<StandIn<double>> model(source);
  EXPECT_THROW(model.set_level(0), HierarchyError);
  // Any height must be accepted, and negative zero must be zero.
  source.at(cluster_id(0, 0)).positions[0] = {1e9, -0.0, std::nan("")};
  EXPECT_NO_THROW(model.set_level(0));
}

TEST(MultiresolutionHostile, RejectsBadRoots) {
  MemorySource source = good_source(2);
  source.root().children.pop_back();
  EXPECT_THROW(StandInModel{source}, HierarchyError);
  source = good_source(2);
  source.root().children[2] = source.root().children[5];
  EXPECT_THROW(StandInModel{source}, HierarchyError);
  source = good_source(2);
  source.root().positions[0][0] = -3;
  EXPECT_THROW(StandInModel{source}, HierarchyError);
}

TEST(MultiresolutionHostile, NanBoxesIntersectNothing) {
  MemorySource source = good_source(2);
  for (auto& level : source.levels) {
    for (auto& cluster : level) cluster.record.box.min[0] = std::nan("");
  }
  StandInModel model(source);
  model.set_region(box2(-1e9, -1e9, 1e9, 1e9), 0);
  EXPECT_EQ(model.expanded_count(), 0u);
}

TEST(MultiresolutionMisuse, RejectsMissingClusters) {
  MemorySource source = good_source(1);
  StandInModel model(source);
  const ClusterId hidden = cluster_id(0, 0), unknown = cluster_id(2, 1000), root = cluster_id(3, 0);
  for (const ClusterId id : {hidden, unknown, root}) {
    EXPECT_FALSE(model.can_expand(id));
    EXPECT_FALSE(model.is_expanded(id));
    EXPECT_THROW(model.expand(id), std::invalid_argument);
    EXPECT_THROW(model.collapse(id), std::invalid_argument);
    EXPECT_THROW(static_cast<void>(model.record(id)), std::invalid_argument);
  }
  std::vector<ClusterId> ids;
  EXPECT_THROW(model.children(hidden, ids), std::invalid_argument);
  EXPECT_NO_THROW(model.children(root, ids));
  EXPECT_EQ(ids.size(), source.root().positions.size());
}

}  // namespace
}  // namespace terrace::tri::test
