// SPDX-License-Identifier: Apache-2.0
#include <map>

#include <gtest/gtest.h>

#include "model/cluster_map.hpp"
#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri::test {
namespace {

TEST(PointId, HigherLevelThenSmallerIdRepresents) {
  const PointId coarse{cluster_id(2, 9), 5}, fine{cluster_id(0, 1), 0};
  EXPECT_TRUE(takes_precedence(coarse, fine));
  EXPECT_FALSE(takes_precedence(fine, coarse));
  EXPECT_TRUE(takes_precedence({cluster_id(1, 3), 8}, {cluster_id(1, 4), 0}));
  EXPECT_TRUE(takes_precedence({cluster_id(1, 3), 7}, {cluster_id(1, 3), 8}));
  EXPECT_FALSE(takes_precedence(coarse, coarse));
}

TEST(Box, IsClosed) {
  const Box3 a{{0, 0, 0}, {2, 2, 2}};
  EXPECT_TRUE(a.intersects({{2, 2, 2}, {3, 3, 3}}));
  EXPECT_FALSE(a.intersects({{2.5, 0, 0}, {3, 2, 2}}));
  EXPECT_TRUE(a.intersects(box2(1, 1, 1, 1)));
  EXPECT_FALSE(a.intersects(box2(3, 1, 4, 1)));
  EXPECT_FALSE(a.intersects({{1, 1, 3}, {1, 1, 2.5}})) << "an empty box";
  EXPECT_TRUE(a.covers(a));
  EXPECT_TRUE(box2(0, 0, 2, 2).covers(a));
  EXPECT_FALSE(a.covers(box2(0, 0, 1, 1)));
}

// Compares with std::map, using ids that differ little, so that long probe sequences form and
// dissolve.
TEST(ClusterMap, BehavesLikeAMap) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    ClusterMap map;
    EXPECT_EQ(map.find(cluster_id(0, 0)), nullptr);
    std::map<ClusterId, std::uint32_t> oracle;
    const std::size_t range = 10 + below(random, 2000);
    const double grow = 0.4 + 0.2 * unit(random);
    for (std::uint32_t step = 0; step < 5000; ++step) {
      const ClusterId id =
          cluster_id(static_cast<unsigned>(below(random, 3)), below(random, range) << (seed % 9));
      if (unit(random) < grow) {
        map.reserve(map.size() + 1);
        ASSERT_EQ(map.insert(id, {step, 7}), oracle.emplace(id, step).second);
      } else if (oracle.erase(id) != 0) {
        map.erase(id);
      }
      ASSERT_EQ(map.size(), oracle.size());
      const ChildRef* found = map.find(id);
      ASSERT_EQ(found != nullptr, oracle.count(id) == 1);
      if (step % 500 != 0) continue;
      for (const auto& [key, value] : oracle) {
        ASSERT_NE(map.find(key), nullptr);
        ASSERT_EQ(*map.find(key), (ChildRef{value, 7}));
      }
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
