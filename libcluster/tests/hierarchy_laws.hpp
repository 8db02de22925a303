// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "recording_sink.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// Checks of the guarantees of every hierarchy by brute force over all descendants. Requires:
/// payloads from numbered_payload().

namespace terrace::cluster::laws {

/// Returns |map * (a - b)| in extended precision.
inline long double ground_distance(const GroundMap& m, const Point3& a, const Point3& b) {
  long double sum = 0.0L;
  for (std::size_t row = 0; row < 3; ++row) {
    long double g = 0.0L;
    for (std::size_t k = 0; k < 3; ++k) {
      g += static_cast<long double>(m[3 * row + k]) *
           (static_cast<long double>(a[k]) - static_cast<long double>(b[k]));
    }
    sum += g * g;
  }
  return std::sqrt(sum);
}

/// Checks that the clusters of a block are a partition, grouped, and in ascending order. medians:
/// if positive, their number; otherwise there are at most half as many clusters as points.
inline void check_partition(const RecordedBlock& block, std::size_t block_size,
                            std::size_t medians = 0) {
  const std::size_t n = block.positions.size();
  const std::size_t clusters = block.representatives.size();
  ASSERT_GE(n, 1u);
  ASSERT_LE(n, block_size);
  ASSERT_GE(clusters, 1u);
  if (medians > 0) {
    ASSERT_EQ(clusters, medians);
  } else {
    ASSERT_LE(clusters, (n + 1) / 2);
  }
  ASSERT_EQ(block.summaries.size(), clusters);
  ASSERT_EQ(block.children.size(), n * block.level);
  ASSERT_EQ(block.payload.size(), n * sizeof(std::uint64_t));
  ASSERT_EQ(block.order.size(), n);
  ASSERT_EQ(block.first.size(), clusters + 1);
  ASSERT_EQ(block.first.front(), 0u);
  ASSERT_EQ(block.first.back(), n);
  ASSERT_TRUE(std::is_sorted(block.first.begin(), block.first.end()));
  std::vector<bool> seen(n, false);
  for (std::size_t c = 0; c < clusters; ++c) {
    const auto members = block.members(c);
    EXPECT_TRUE(std::is_sorted(members.begin(), members.end()));
    EXPECT_TRUE(std::binary_search(members.begin(), members.end(), block.representatives[c]));
    for (const std::uint32_t i : members) {
      ASSERT_LT(i, n);
      ASSERT_FALSE(seen[i]);
      seen[i] = true;
    }
  }
}

/// A cluster with its block and all its descendants, as input indices.
struct Expanded {
  const RecordedBlock* block = nullptr;
  std::size_t c = 0;
  std::vector<std::uint64_t> descendants;

  [[nodiscard]] std::uint32_t representative() const { return block->representatives[c]; }
};

/// Compares a summary with its descendants. The map must be the same for all blocks.
inline void check_summary(const Expanded& cluster, std::span<const Point3> input,
                          const GroundMap& map) {
  const ClusterSummary& summary = cluster.block->summaries[cluster.c];
  const Point3& from = cluster.block->positions[cluster.representative()];
  EXPECT_EQ(summary.descendants, cluster.descendants.size());
  Box3 box{from, from};
  long double farthest = 0.0L;
  for (const std::uint64_t id : cluster.descendants) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = std::min(box.min[axis], input[id][axis]);
      box.max[axis] = std::max(box.max[axis], input[id][axis]);
    }
    farthest = std::max(farthest, ground_distance(map, from, input[id]));
  }
  EXPECT_EQ(summary.box, box);
  EXPECT_GE(static_cast<long double>(summary.error), farthest);
  if (cluster.block->level == 0) {
    EXPECT_LE(static_cast<long double>(summary.error), farthest * (1.0L + 1e-12L));
  }
  // No corner is farther away than three edges.
  long double edges = 0.0L;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Point3 corner = box.min;
    corner[axis] = box.max[axis];
    edges += ground_distance(map, box.min, corner);
  }
  EXPECT_LE(static_cast<long double>(summary.error), edges * (1.0L + 1e-12L));
}

/// Checks everything. `map` is the map of all blocks. medians: as in HierarchyOptions.
inline void check_hierarchy(const RecordingSink& sink, const HierarchyResult& result,
                            std::span<const Point3> input, std::size_t block_size,
                            const GroundMap& map = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                            std::size_t medians = 0) {
  ASSERT_TRUE(sink.has_root);
  ASSERT_EQ(result.points, input.size());
  ASSERT_EQ(result.top, sink.levels.size());
  ASSERT_EQ(sink.top.level, result.top);
  ASSERT_EQ(result.level_points.size(), result.top + 1);
  ASSERT_EQ(result.level_clusters.size(), result.top + 1);
  ASSERT_LE(sink.top.positions.size(), block_size);

  // The expected content of each level: the input, or the clusters of the level below, in order.
  std::vector<Expanded> below;
  std::vector<std::vector<std::uint64_t>> heads;  // input index, by level and ordinal
  std::vector<bool> placed(input.size(), false);
  const auto place = [&](std::uint64_t id) {
    ASSERT_FALSE(placed[id]) << "point " << id << " is in two places";
    placed[id] = true;
  };
  const auto check_point = [&](const RecordedBlock& block, std::size_t i, std::uint64_t number) {
    const std::uint64_t id = block.id(i);
    ASSERT_LT(id, input.size());
    ASSERT_EQ(block.positions[i], input[id]);
    if (block.level == 0) {
      ASSERT_EQ(id, number);
      return;
    }
    ASSERT_EQ(block.children[i * block.level + block.level - 1], number);
    for (unsigned l = 0; l < block.level; ++l) {
      const std::uint64_t child = block.children[i * block.level + l];
      ASSERT_LT(child, heads[l].size());
      ASSERT_EQ(heads[l][child], id) << "child on level " << l;
    }
  };

  for (unsigned level = 0; level < result.top; ++level) {
    SCOPED_TRACE(testing::Message() << "level " << level);
    std::vector<Expanded> clusters;
    heads.emplace_back();
    std::uint64_t number = 0;
    const bool last = medians > 0 && level + 1 == result.top && sink.levels[level].size() == 1;
    for (const RecordedBlock& block : sink.levels[level]) {
      SCOPED_TRACE(testing::Message() << "block " << block.block);
      ASSERT_NO_FATAL_FAILURE(check_partition(block, block_size, last ? medians : 0));
      const std::uint64_t base = number;
      for (std::size_t i = 0; i < block.positions.size(); ++i) {
        ASSERT_NO_FATAL_FAILURE(check_point(block, i, number++));
      }
      for (std::size_t c = 0; c < block.representatives.size(); ++c) {
        Expanded cluster{&block, c, {}};
        for (const std::uint32_t i : block.members(c)) {
          if (level == 0) {
            cluster.descendants.push_back(block.id(i));
          } else {
            const auto& child = below[base + i].descendants;
            cluster.descendants.insert(cluster.descendants.end(), child.begin(), child.end());
          }
          if (i != block.representatives[c]) {
            ASSERT_NO_FATAL_FAILURE(place(block.id(i)));
          }
        }
        check_summary(cluster, input, map);
        heads[level].push_back(block.id(cluster.representative()));
        clusters.push_back(std::move(cluster));
      }
    }
    EXPECT_GT(number, last ? medians : block_size) << "this level should be the root";
    EXPECT_EQ(number, level == 0 ? input.size() : below.size());
    EXPECT_EQ(result.level_points[level], number);
    EXPECT_EQ(result.level_clusters[level], clusters.size());
    below = std::move(clusters);
  }

  SCOPED_TRACE("root");
  const std::size_t n = sink.top.positions.size();
  EXPECT_EQ(n, result.top == 0 ? input.size() : below.size());
  EXPECT_EQ(result.level_points[result.top], n);
  EXPECT_EQ(result.level_clusters[result.top], 1u);
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_NO_FATAL_FAILURE(check_point(sink.top, i, i));
    ASSERT_NO_FATAL_FAILURE(place(sink.top.id(i)));
    EXPECT_EQ(sink.top.order[i], i);
  }
  EXPECT_EQ(sink.top.first, (std::vector<std::uint32_t>{0, static_cast<std::uint32_t>(n)}));
  EXPECT_EQ(sink.top.representatives, std::vector<std::uint32_t>{kNoRepresentative});
  ASSERT_EQ(sink.top.summaries.size(), 1u);
  EXPECT_EQ(sink.top.summaries[0].descendants, input.size());
  EXPECT_EQ(sink.top.summaries[0].error, 0.0);
  for (const Point3& p : input) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_LE(sink.top.summaries[0].box.min[axis], p[axis]);
      ASSERT_GE(sink.top.summaries[0].box.max[axis], p[axis]);
    }
  }
  EXPECT_TRUE(std::all_of(placed.begin(), placed.end(), [](bool p) { return p; }));
}

}  // namespace terrace::cluster::laws
