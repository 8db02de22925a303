// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/local_search.hpp"

#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "inputs.hpp"

namespace terrace::cluster {
namespace {

TEST(CandidateCount, FollowsTheThesis) {
  // 1640 points: 6560 iterations (thesis 7.3.4), so its logarithm is the decimal one.
  EXPECT_EQ(candidate_count(SearchLength::log10_full, 1640), 6560u);
  EXPECT_EQ(candidate_count(SearchLength::log10_full, 10000), 40000u);
  EXPECT_EQ(candidate_count(SearchLength::log2_full, 10000), 140000u);
  EXPECT_EQ(candidate_count(SearchLength::log2_full, 1024), 10240u);
  EXPECT_EQ(candidate_count(SearchLength::tenth, 10000), 1000u);
  EXPECT_EQ(candidate_count(SearchLength::tenth, 3), 1u);
  EXPECT_EQ(candidate_count(SearchLength::log2_full, 1), 1u);
  EXPECT_EQ(candidate_count(SearchLength::tenth, 0), 0u);
}

TEST(LocalSearch, IsNearTheOptimumOnTinyBlocks) {
  double sum = 0.0;
  constexpr int kBlocks = 60;
  for (std::uint64_t seed = 1; seed <= kBlocks; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = inputs::cube(2 + seed % 9, random);
    const double facility_cost = 0.1 + 0.4 * inputs::uniform(random);
    BlockClustering clustering;
    local_search(points, {}, facility_cost, SearchLength::log2_full, seed, clustering);
    const double best = laws::optimum(points, {}, facility_cost);
    ASSERT_GE(clustering.cost(), best * (1 - 1e-12));
    ASSERT_LE(clustering.cost(), best * 3);  // the proven factor of a local optimum
    sum += clustering.cost() / best;
  }
  EXPECT_LE(sum / kBlocks, 1.05);
}

TEST(LocalSearch, EqualPointsAreOneCluster) {
  const std::vector<Point3> points(50, Point3{3, 4, 5});
  BlockClustering clustering;
  local_search(points, {}, 1.0, SearchLength::log10_full, 1, clustering);
  EXPECT_EQ(clustering.facilities.size(), 1u);
  EXPECT_EQ(clustering.cost(), 0.0);
}

TEST(LocalSearch, MoreCandidatesCostLess) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = inputs::dem_tiles(40, 40, 30.0, 2.65, random);
  double tenth = 0.0;
  double full = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    BlockClustering clustering;
    local_search(points, {}, 1.0, SearchLength::tenth, seed, clustering);
    tenth += clustering.cost();
    local_search(points, {}, 1.0, SearchLength::log10_full, seed, clustering);
    full += clustering.cost();
  }
  EXPECT_LT(full, tenth);
}

TEST(LocalSearch, NoPointsGiveAnEmptyResult) {
  BlockClustering clustering;
  clustering.facilities = {1, 2, 3};
  local_search({}, {}, 1.0, SearchLength::tenth, 1, clustering);
  EXPECT_TRUE(clustering.facilities.empty());
  EXPECT_EQ(clustering.cost(), 0.0);
}

}  // namespace
}  // namespace terrace::cluster
