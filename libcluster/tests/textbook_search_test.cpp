// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "facility/points/local_search.hpp"
#include "inputs.hpp"

namespace terrace::cluster {
namespace {

TEST(CandidateCount, FollowsTheThesis) {
  // The thesis (7.3.4) uses 6560 iterations for 1640 points, so its logarithm is decimal.
  EXPECT_EQ(candidate_count(Effort::fine, 1640), 6560u);
  EXPECT_EQ(candidate_count(Effort::fine, 10000), 40000u);
  EXPECT_EQ(candidate_count(Effort::full, 10000), 140000u);
  EXPECT_EQ(candidate_count(Effort::full, 1024), 10240u);
  EXPECT_EQ(candidate_count(Effort::standard, 10000), 1000u);
  EXPECT_EQ(candidate_count(Effort::fast, 10000), 1000u);
  EXPECT_EQ(candidate_count(Effort::standard, 3), 1u);
  EXPECT_EQ(candidate_count(Effort::full, 1), 1u);
  EXPECT_EQ(candidate_count(Effort::standard, 0), 0u);
}

TEST(TextbookSearch, IsNearTheOptimumOnTinyBlocks) {
  double sum = 0.0;
  constexpr int kBlocks = 60;
  for (std::uint64_t seed = 1; seed <= kBlocks; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = inputs::cube(2 + seed % 9, random);
    const double facility_cost = 0.1 + 0.4 * inputs::uniform(random);
    const double cost = laws::textbook_search(points, facility_cost, Effort::full, seed).cost();
    const double best = laws::optimum(points, {}, facility_cost);
    ASSERT_GE(cost, best * (1 - 1e-12));
    ASSERT_LE(cost, best * 3);  // the proven bound for a local optimum
    sum += cost / best;
  }
  EXPECT_LE(sum / kBlocks, 1.05);
}

TEST(TextbookSearch, EqualPointsAreOneCluster) {
  const std::vector<Point3> points(50, Point3{3, 4, 5});
  const FacilitySolution solution = laws::textbook_search(points, 1.0, Effort::fine, 1);
  EXPECT_EQ(solution.facilities.size(), 1u);
  EXPECT_EQ(solution.cost(), 0.0);
}

TEST(TextbookSearch, MoreCandidatesCostLess) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = inputs::dem_tiles(40, 40, 30.0, 2.65, random);
  double standard = 0.0, fine = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    standard += laws::textbook_search(points, 1.0, Effort::standard, seed).cost();
    fine += laws::textbook_search(points, 1.0, Effort::fine, seed).cost();
  }
  EXPECT_LT(fine, standard);
}

}  // namespace
}  // namespace terrace::cluster
