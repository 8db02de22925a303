// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "linkage_laws.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using laws::heights_of;

/// Returns the lengths of the minimum spanning tree's edges, ascending, by Prim's algorithm in
/// O(n^2).
std::vector<double> prim(const std::vector<Point3>& points) {
  const laws::Distances d = laws::distances_of(points);
  std::vector<double> near(points.size(), std::numeric_limits<double>::infinity());
  std::vector<bool> done(points.size(), false);
  std::vector<double> lengths;
  std::size_t last = 0;
  done[0] = true;
  for (std::size_t step = 1; step < points.size(); ++step) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (done[i]) continue;
      near[i] = std::min(near[i], d[last][i]);
      if (done[next] || near[i] < near[next]) next = i;
    }
    done[next] = true;
    lengths.push_back(near[next]);
    last = next;
  }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

void expect_near(const std::vector<double>& got, const std::vector<double>& expected) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t r = 0; r < got.size(); ++r) {
    ASSERT_NEAR(got[r], expected[r], 1e-14 * expected[r]) << "row " << r;
  }
}

TEST(SingleLinkage, EqualsTheTextbook) {
  for (const std::size_t count : {2u, 3u, 8u, 9u, 10u, 17u, 60u}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      for (const auto& [name, points] : laws::linkage_inputs(count, seed)) {
        SCOPED_TRACE(testing::Message() << name << ", " << count << " points, seed " << seed);
        const Dendrogram dendrogram = single_linkage(points);
        ASSERT_EQ(dendrogram_fault(dendrogram), "");
        expect_near(heights_of(dendrogram), laws::brute_heights(laws::distances_of(points), false));
        // Checks the clusters themselves: a cut of single linkage at a height gives the components.
        const laws::Distances d = laws::distances_of(points);
        const auto members = laws::members_of(dendrogram);
        for (const Merge& merge : dendrogram.merges) {
          double least = std::numeric_limits<double>::infinity();
          for (const std::uint32_t i : members[merge.a]) {
            for (const std::uint32_t j : members[merge.b]) least = std::min(least, d[i][j]);
          }
          ASSERT_NEAR(merge.height, least, 1e-14 * least);
        }
      }
    }
  }
}

TEST(SingleLinkage, IsTheMinimumSpanningTree) {
  for (const std::size_t count : {300u, 1500u}) {
    for (const auto& [name, points] : laws::linkage_inputs(count, 7)) {
      SCOPED_TRACE(testing::Message() << name << ", " << count << " points, seed 7");
      if (name == "geometric spacing") continue;  // distances exceed the range of double
      const Dendrogram dendrogram = single_linkage(points);
      ASSERT_EQ(dendrogram_fault(dendrogram), "");
      expect_near(heights_of(dendrogram), prim(points));
    }
  }
}

TEST(SingleLinkage, DoesNotDependOnThreads) {
  for (const auto& [name, points] : laws::linkage_inputs(8000, 3)) {
    if (name == "geometric spacing") continue;
    SCOPED_TRACE(testing::Message() << name << ", seed 3");
    const Dendrogram one = single_linkage(points);
    ASSERT_EQ(dendrogram_fault(one), "");
    ASSERT_EQ(one, single_linkage(points, {.threads = 2}));
    ASSERT_EQ(one, single_linkage(points, {.threads = 7}));
  }
}

TEST(SingleLinkage, HandlesManyPointsInFewPlaces) {
  std::mt19937_64 random(5);
  const std::vector<Point3> places = inputs::cube(1000, random);
  std::vector<Point3> points;
  for (unsigned i = 0; i < 100000; ++i) points.push_back(places[random() % places.size()]);
  const std::vector<double> heights = heights_of(single_linkage(points, {.threads = 2}));
  const std::vector<double> expected = prim(places);
  EXPECT_EQ(heights[heights.size() - places.size()], 0.0);
  expect_near({heights.end() - 999, heights.end()}, expected);
}

TEST(SingleLinkage, CandidatesThatContainTheTreeGiveTheSameResult) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = inputs::cube(500, random);
    std::vector<PointPair> pairs;
    for (const Link& link : spanning_tree(points)) pairs.push_back({link.j, link.i});
    for (unsigned k = 0; k < 2000; ++k) {
      pairs.push_back(
          {static_cast<std::uint32_t>(random() % 500), static_cast<std::uint32_t>(random() % 500)});
    }
    laws::shuffle(pairs, random);
    EXPECT_EQ(single_linkage(points, pairs), single_linkage(points));
  }
}

TEST(SingleLinkage, RejectsInvalidCandidates) {
  const std::vector<Point3> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const auto error = [&](const std::vector<PointPair>& pairs) -> std::string {
    try {
      (void)single_linkage(points, pairs);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "no exception";
  };
  EXPECT_PRED2(laws::contains, error({{0, 1}, {2, 3}}), "point 2");
  EXPECT_PRED2(laws::contains, error({}), "point 1");
  EXPECT_PRED2(laws::contains, error({{0, 1}, {4, 3}}), "candidate 1");
  EXPECT_EQ(error({{0, 1}, {1, 1}, {3, 1}, {2, 3}, {1, 0}}), "no exception");
}

TEST(SingleLinkage, HandlesFewPointsAndNamesBadOnes) {
  EXPECT_TRUE(single_linkage(std::vector<Point3>{}).merges.empty());
  EXPECT_TRUE(single_linkage(std::vector<Point3>{{1, 2, 3}}).merges.empty());
  EXPECT_TRUE(
      single_linkage(std::vector<Point3>{{1, 2, 3}}, std::vector<PointPair>{}).merges.empty());
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), infinity, -infinity, 2e307}) {
    std::vector<Point3> points(10, Point3{1, 2, 3});
    points[6][1] = bad;
    try {
      (void)single_linkage(points);
      ADD_FAILURE() << "no exception for " << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_PRED2(laws::contains, error.what(), "point 6");
    }
  }
}

TEST(SingleLinkage, ZerosOfBothSignsAreOnePoint) {
  const Dendrogram dendrogram =
      single_linkage(std::vector<Point3>{{0.0, 0.0, 1.0}, {-0.0, 0.0, 1.0}, {0.0, -0.0, 2.0}});
  EXPECT_EQ(heights_of(dendrogram), (std::vector<double>{0.0, 1.0}));
}

}  // namespace
}  // namespace terrace::cluster
