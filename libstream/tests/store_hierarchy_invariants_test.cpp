// SPDX-License-Identifier: Apache-2.0
// One test per statement of FORMAT.md about the hierarchy: a store with valid checksums that
// violates it is rejected when it is opened or read, or reported by verify.
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store_invariants_testing.hpp"

namespace terrace::stream {
namespace {

using store::Entry;
using store::RawBlock;
using testing::StoreFiles;

TEST(StoreInvariants, UpdatingTheChecksumsOfASoundStoreChangesNothing) {
  for (StoreFiles files : {testing::grid_files(), testing::cloud_files()}) {
    const StoreFiles before = files;
    testing::update_checksums(files);
    EXPECT_TRUE(files == before);
    testing::edit_page(files, 0, 1, [](std::vector<Entry>&, std::uint64_t&) {});
    EXPECT_TRUE(files == before);
    const TempFolder folder;
    testing::write_files(folder.path(), files);
    EXPECT_EQ(testing::problems_of(Store::open(folder.path())), "");
  }
}

/// Returns the store of testing::small_blocks() after `edit` changed its hierarchy.
StoreFiles edited_store(const std::function<void(std::vector<RawBlock>&)>& edit) {
  std::vector<std::vector<Point3>> blocks;
  for (const auto& block : testing::small_blocks()) blocks.push_back(block.positions);
  std::vector<RawBlock> recorded = testing::recorded_hierarchy(blocks, testing::kSmallOptions);
  edit(recorded);
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", testing::small_grid());
  for (const RawBlock& block : recorded) {
    if (block.representatives[0] == kNoRepresentative) {
      writer.finish(block.view());
    } else {
      writer.append(writer.encode(block.view()));
    }
  }
  return testing::read_files(folder.path() / "s");
}

RawBlock& block_of(std::vector<RawBlock>& blocks, unsigned level) {
  return *std::find_if(blocks.begin(), blocks.end(),
                       [&](const RawBlock& block) { return block.level == level; });
}

/// Returns a point of the block that does not represent one of its clusters.
std::uint32_t first_non_representative(const RawBlock& block) {
  std::uint32_t point = 0;
  while (std::find(block.representatives.begin(), block.representatives.end(), point) !=
         block.representatives.end()) {
    ++point;
  }
  return point;
}

TEST(StoreInvariants, WritesTheSameStoreFromItsHierarchy) {
  EXPECT_TRUE(edited_store([](auto&) {}) == testing::grid_files());
}

// If two points are parents of the same cluster, another cluster has no parent.
TEST(StoreInvariants, ReportsClustersWithTwoParentPointsOrNone) {
  const StoreFiles files = edited_store([](auto& blocks) {
    RawBlock& block = block_of(blocks, 1);
    const std::uint32_t point = first_non_representative(block);
    block.children[point] = block.children[point + 1];
  });
  testing::expect_problem(files, "has two parent points");
  testing::expect_problem(files, "has no parent point");
}

TEST(StoreInvariants, RejectsChildrenThatDoNotExist) {
  testing::expect_unreadable(edited_store([](auto& blocks) {
                               RawBlock& block = block_of(blocks, 1);
                               block.children[first_non_representative(block)] = 1000000;
                             }),
                             "heads a cluster that does not exist");
}

TEST(StoreInvariants, ReportsRepresentativesAtAnotherPosition) {
  testing::expect_problem(edited_store([](auto& blocks) {
                            RawBlock& block = block_of(blocks, 1);
                            block.positions[first_non_representative(block)][2] += 1;
                          }),
                          "differ from their parent points");
}

TEST(StoreInvariants, ReportsRepresentativesWithOtherChildren) {
  testing::expect_problem(edited_store([](auto& blocks) {
                            RawBlock& block = block_of(blocks, 1);
                            std::swap(block.children[block.representatives[0]],
                                      block.children[block.representatives[1]]);
                          }),
                          "differ from their parent points");
}

TEST(StoreInvariants, ReportsWrongNumbersOfDescendants) {
  testing::expect_problem(
      edited_store([](auto& blocks) { --block_of(blocks, 1).summaries[0].descendants; }),
      "the descendants do not add up");
}

TEST(StoreInvariants, ReportsBoxesThatExcludeClustersBelow) {
  testing::expect_problem(edited_store([](auto& blocks) {
                            RawBlock& block = block_of(blocks, 1);
                            const Point3 position = block.positions[block.representatives[0]];
                            block.summaries[0].box = {position, position};
                          }),
                          "a cluster below exceeds its box");
}

// Boxes that start at a multiple of 32 and have 32 columns look like rounded-up boxes. The box
// above must still contain the points themselves.
TEST(StoreInvariants, VerifyFindsBoxesThatMissOnePoint) {
  for (const int missed : {0, 1, 31}) {
    const TempFolder folder;
    StoreWriter writer(folder.path() / "s", testing::grid_schema(ScalarType::i16));
    std::vector<Point3> positions;
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < 64; ++i) {
      positions.push_back({32.0 + i, 0, 0});
      order.push_back(i);
    }
    const std::vector<std::uint32_t> block_starts{0, 32, 64}, representatives{31, 60},
        root_starts{0, 2}, no_representative{kNoRepresentative};
    const std::vector<ClusterSummary> summaries{{{positions[0], positions[31]}, 40, 32},
                                                {{positions[32], positions[63]}, 40, 32}};
    const std::vector<Point3> parents{positions[31], positions[60]};
    const std::vector<std::uint64_t> children{0, 1};
    const auto first_covered = static_cast<std::size_t>(missed);
    const std::vector<ClusterSummary> root{{{positions[first_covered], positions[63]}, 40, 64}};
    writer.append(writer.encode({.level = 0,
                                 .positions = positions,
                                 .payload = {},
                                 .children = {},
                                 .first = block_starts,
                                 .order = order,
                                 .representatives = representatives,
                                 .summaries = summaries}));
    writer.finish({.level = 1,
                   .positions = parents,
                   .payload = {},
                   .children = children,
                   .first = root_starts,
                   .order = std::span(order).first(2),
                   .representatives = no_representative,
                   .summaries = root});
    const std::string problems = testing::problems_of(Store::open(folder.path() / "s"));
    if (missed == 0) {
      EXPECT_EQ(problems, "");
    } else {
      EXPECT_EQ(problems, "cluster 1/0: a cluster below exceeds its box\n");
    }
  }
}

}  // namespace
}  // namespace terrace::stream
