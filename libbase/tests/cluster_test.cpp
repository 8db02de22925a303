// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <gtest/gtest.h>
#include <terrace/base/cluster.hpp>

namespace terrace::base {
namespace {

TEST(ClusterId, HasALevelAndAnOrdinal) {
  for (const unsigned level : {0u, 1u, 255u}) {
    for (const std::uint64_t ordinal :
         {std::uint64_t{0}, std::uint64_t{1} << 55, kClusterOrdinalEnd - 1}) {
      const ClusterId id = cluster_id(level, ordinal);
      EXPECT_EQ(level_of(id), level);
      EXPECT_EQ(ordinal_of(id), ordinal);
    }
  }
}

TEST(ClusterId, IsOrderedByLevelThenOrdinal) {
  EXPECT_LT(cluster_id(2, 3), cluster_id(2, 4));
  EXPECT_LT(cluster_id(2, kClusterOrdinalEnd - 1), cluster_id(3, 0));
}

TEST(ClusterId, NamesItselfInMessages) {
  EXPECT_EQ(to_string(cluster_id(3, 12)), "cluster 12 of level 3");
}

TEST(ClusterSummary, IsEqualOnlyIfAllPartsAre) {
  const ClusterSummary summary{{{0, 0, 0}, {1, 2, 3}}, 0.5, 7};
  ClusterSummary other = summary;
  EXPECT_EQ(other, summary);
  other.descendants = 8;
  EXPECT_NE(other, summary);
}

}  // namespace
}  // namespace terrace::base
