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

TEST(LocalSearch, GainIsWhatOpeningSpares) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    // A coarse grid, so that duplicates and ties happen.
    std::vector<Point3> points = inputs::cube(200, random);
    if (seed % 2 == 0) {
      for (Point3& p : points) {
        for (double& v : p) v = std::floor(v * 5);
      }
    }
    std::vector<double> weights;
    if (seed % 3 == 0) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        weights.push_back(0.1 + 10 * inputs::uniform(random));
      }
    }
    LocalSearch search(points, weights, seed % 4 == 0 ? 0.2 : 1.0);
    search.start(random);
    unsigned closed = 0;
    for (int step = 0; step < 300; ++step) {
      const auto candidate = static_cast<std::uint32_t>(random() % points.size());
      const double before = search.cost();
      const std::size_t facilities = search.facility_count();
      const double gain = search.gain(candidate);
      // Losses are carried out as well: the law does not depend on the sign.
      if (gain <= 0 && step % 5 != 0) continue;
      search.open(candidate);
      closed += search.facility_count() <= facilities ? 1u : 0u;
      ASSERT_NEAR(before - search.cost(), gain, 1e-9 * before);
      BlockClustering clustering;
      search.result(clustering);
      ASSERT_NEAR(clustering.cost(), search.cost(), 1e-9 * before);
      for (std::size_t c = 0; c < clustering.facilities.size(); ++c) {
        ASSERT_EQ(clustering.assignment[clustering.facilities[c]], c);
      }
    }
    EXPECT_GT(closed, 0u);
  }
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
