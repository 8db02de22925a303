// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// Hierarchies that are joined by the points of their top levels.

namespace terrace::cluster {
namespace {

/// A cluster: the input indices of its representative and of the points that are only members, and
/// the clusters that these head.
struct StoredCluster {
  std::uint64_t representative = 0;
  ClusterSummary summary;
  std::vector<std::uint64_t> members;
  std::vector<std::vector<std::uint64_t>> children;  ///< of each member, level 0 first
  std::vector<std::uint64_t> own_children;           ///< of the representative
};

/// The clusters of several hierarchies below their tops, and then those of their join.
struct JoinedClusters {
  std::vector<std::vector<StoredCluster>> levels;
  RecordedBlock root;
  HierarchyResult result;
};

HierarchyOptions blocks_of_64(unsigned threads = 1) {
  HierarchyOptions options;
  options.block_size = 64;
  options.payload_size = sizeof(std::uint64_t);
  options.threads = threads;
  return options;
}

std::vector<std::uint64_t> shifted_children(const RecordedBlock& block, std::size_t point,
                                            std::span<const std::uint64_t> offsets) {
  std::vector<std::uint64_t> children;
  for (unsigned l = 0; l < block.level; ++l) {
    children.push_back(block.children[point * block.level + l] +
                       (l < offsets.size() ? offsets[l] : 0));
  }
  return children;
}

void add_clusters(const RecordedBlock& block, std::span<const std::uint64_t> offsets,
                  std::vector<StoredCluster>& clusters) {
  for (std::size_t c = 0; c < block.representatives.size(); ++c) {
    StoredCluster& cluster = clusters.emplace_back();
    const std::uint32_t representative = block.representatives[c];
    cluster.representative = block.id(representative);
    cluster.summary = block.summaries[c];
    cluster.own_children = shifted_children(block, representative, offsets);
    for (const std::uint32_t i : block.members(c)) {
      if (i == representative) continue;
      cluster.members.push_back(block.id(i));
      cluster.children.push_back(shifted_children(block, i, offsets));
    }
  }
}

/// Builds a hierarchy of each part of the input and joins them.
JoinedClusters join(std::span<const Point3> input, std::span<const std::size_t> ends,
                    unsigned threads) {
  std::vector<RecordingSink> sinks(ends.size());
  std::vector<HierarchyResult> results;
  for (std::size_t part = 0, begin = 0; part < ends.size(); begin = ends[part++]) {
    HierarchyBuilder builder(blocks_of_64(threads), sinks[part]);
    builder.push(input.subspan(begin, ends[part] - begin), numbered_payload(begin, ends[part]));
    results.push_back(builder.finish());
  }
  JoinedClusters joined;
  std::vector<std::vector<std::uint64_t>> offsets;  // by part and level
  for (std::size_t part = 0; part < ends.size(); ++part) {
    std::vector<std::uint64_t>& of_part = offsets.emplace_back();
    joined.levels.resize(std::max<std::size_t>(joined.levels.size(), results[part].top));
    for (const auto& level : joined.levels) of_part.push_back(level.size());
    for (unsigned l = 0; l < results[part].top; ++l) {
      for (const RecordedBlock& block : sinks[part].levels[l]) {
        add_clusters(block, of_part, joined.levels[l]);
      }
    }
  }
  HierarchyOptions options = blocks_of_64(threads);
  for (const auto& level : joined.levels) options.existing_clusters.push_back(level.size());
  RecordingSink sink;
  HierarchyBuilder builder(options, sink);
  for (std::size_t part = 0; part < ends.size(); ++part) {
    const RecordedBlock& top = sinks[part].top;
    if (top.level == 0) {
      builder.push(top.positions, top.payload);
      continue;
    }
    std::vector<std::uint64_t> children;
    std::vector<ClusterSummary> summaries;
    for (std::size_t i = 0; i < top.positions.size(); ++i) {
      const auto of_point = shifted_children(top, i, offsets[part]);
      children.insert(children.end(), of_point.begin(), of_point.end());
      summaries.push_back(joined.levels[top.level - 1][of_point.back()].summary);
    }
    builder.push_heads({top.level, top.positions, top.payload, children, summaries});
  }
  joined.result = builder.finish();
  joined.levels.resize(joined.result.top);
  for (std::size_t l = 0; l < sink.levels.size(); ++l) {
    for (const RecordedBlock& block : sink.levels[l]) add_clusters(block, {}, joined.levels[l]);
  }
  joined.root = sink.top;
  return joined;
}

/// Checks by brute force that every point is in one place, that every cluster is headed by its
/// representative, and that summaries describe all descendants.
void check_joined(const JoinedClusters& joined, std::span<const Point3> input) {
  const unsigned top = joined.result.top;
  ASSERT_EQ(joined.root.level, top);
  std::vector<int> places(input.size(), 0);
  std::vector<std::vector<int>> headed;
  for (const auto& level : joined.levels) headed.emplace_back(level.size(), 0);
  const auto head = [&](std::uint64_t id, const std::vector<std::uint64_t>& children) {
    ++places[id];
    for (std::size_t l = 0; l < children.size(); ++l) {
      ASSERT_LT(children[l], joined.levels[l].size());
      ++headed[l][children[l]];
      EXPECT_EQ(joined.levels[l][children[l]].representative, id);
    }
  };
  std::vector<std::vector<std::vector<std::uint64_t>>> below(top);  // descendants
  for (unsigned l = 0; l < top; ++l) {
    for (const StoredCluster& cluster : joined.levels[l]) {
      ASSERT_EQ(cluster.own_children.size(), l);
      std::vector<std::uint64_t>& all = below[l].emplace_back();
      const auto add = [&](std::uint64_t id, const std::vector<std::uint64_t>& children) {
        if (l == 0) return all.push_back(id);
        const auto& of_child = below[l - 1][children[l - 1]];
        all.insert(all.end(), of_child.begin(), of_child.end());
      };
      for (std::size_t i = 0; i < cluster.members.size(); ++i) {
        head(cluster.members[i], cluster.children[i]);
        add(cluster.members[i], cluster.children[i]);
      }
      add(cluster.representative, cluster.own_children);
      EXPECT_EQ(cluster.summary.descendants, all.size());
      Box3 box;
      for (const std::uint64_t id : all) {
        box.include(input[id]);
        EXPECT_LE(laws::ground_distance(kIdentityMap, input[cluster.representative], input[id]),
                  static_cast<long double>(cluster.summary.error));
      }
      EXPECT_EQ(cluster.summary.box, box);
    }
  }
  for (std::size_t i = 0; i < joined.root.positions.size(); ++i) {
    head(joined.root.id(i), shifted_children(joined.root, i, {}));
  }
  EXPECT_TRUE(std::all_of(places.begin(), places.end(), [](int n) { return n == 1; }));
  for (const std::vector<int>& level : headed) {
    EXPECT_TRUE(std::all_of(level.begin(), level.end(), [](int n) { return n == 1; }));
  }
  EXPECT_EQ(joined.root.summaries[0].descendants, input.size());
  EXPECT_LE(joined.root.positions.size(), blocks_of_64().block_size);
}

TEST(HierarchyJoin, IsOneHierarchyOfAllPoints) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    // Parts of very different sizes, so that their tops are on different levels.
    std::vector<Point3> input;
    std::vector<std::size_t> ends;
    const std::size_t parts = 1 + random() % 6;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t sizes[] = {1, 1 + random() % 64, 65 + random() % 400, 6000};
      std::vector<Point3> points = inputs::cube(sizes[random() % 4], random);
      for (Point3& p : points) p[0] += 2.0 * static_cast<double>(part);
      if (random() % 4 == 0) std::fill(points.begin(), points.end(), points.front());
      input.insert(input.end(), points.begin(), points.end());
      ends.push_back(input.size());
    }
    const JoinedClusters joined = join(input, ends, 1);
    check_joined(joined, input);
    const JoinedClusters parallel = join(input, ends, 3);
    EXPECT_EQ(parallel.root, joined.root);
    EXPECT_EQ(parallel.result.level_clusters, joined.result.level_clusters);
  }
}

TEST(HierarchyJoin, RefusesWhatDoesNotMatch) {
  RecordingSink sink;
  HierarchyBuilder builder(blocks_of_64(), sink);
  const std::vector<Point3> points{{0, 0, 0}};
  const std::vector<std::byte> payload = numbered_payload(0, 1);
  const std::vector<std::uint64_t> children{0};
  const std::vector<ClusterSummary> summaries(1);
  EXPECT_THROW(builder.push_heads({0, points, payload, {}, summaries}), std::invalid_argument);
  EXPECT_THROW(builder.push_heads({1, points, payload, {}, summaries}), std::invalid_argument);
  EXPECT_THROW(builder.push_heads({1, points, {}, children, summaries}), std::invalid_argument);
  EXPECT_THROW(builder.push_heads({1, points, payload, children, {}}), std::invalid_argument);
  const std::vector<Point3> infinite{{0, inputs::kInfinity, 0}};
  EXPECT_THROW(builder.push_heads({1, infinite, payload, children, summaries}),
               std::invalid_argument);
  builder.push_heads({1, points, payload, children, summaries});  // it is unchanged
  EXPECT_EQ(builder.finish().top, 1u);
}

}  // namespace
}  // namespace terrace::cluster
