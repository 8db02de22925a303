// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/large_matching.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"

namespace terrace::matching {
namespace {

using oracles::uniform;

template <std::size_t D>
using Points = std::vector<std::array<double, D>>;

template <std::size_t D>
double length(const std::array<double, D>& p, const std::array<double, D>& q) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) sum += (p[d] - q[d]) * (p[d] - q[d]);
  return std::sqrt(sum);
}

/// Makes sets of several kinds: uniform, clumps of very different density, a grid (all ties), a
/// line, and few places with many duplicates.
template <std::size_t D>
Points<D> points_of_kind(int kind, std::size_t n, std::mt19937_64& random) {
  Points<D> points(n);
  Points<D> centres(6);
  for (auto& p : centres) {
    for (double& c : p) c = uniform(random);
  }
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t d = 0; d < D; ++d) {
      const double u = uniform(random);
      double& c = points[k][d];
      if (kind == 0) c = u;
      if (kind == 1) c = centres[k % 6][d] + std::pow(u - 0.5, 3.0);
      if (kind == 2) c = std::floor(40 * u);
      if (kind == 3) c = d == 0 ? u : 0.25;
      if (kind == 4) c = std::floor(3 * u);
    }
  }
  return points;
}

template <std::size_t D>
void expect_matching(const LargeMatching& m, const Points<D>& points) {
  ASSERT_EQ(m.mate.size(), points.size());
  double cost = 0.0;
  std::size_t unmatched = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (m.mate[i] == kNone) {
      ++unmatched;
      EXPECT_EQ(m.left_over, i);
      continue;
    }
    ASSERT_LT(m.mate[i], points.size());
    ASSERT_NE(m.mate[i], i);
    ASSERT_EQ(m.mate[m.mate[i]], i);
    if (i < m.mate[i]) cost += length(points[i], points[m.mate[i]]);
  }
  EXPECT_EQ(unmatched, points.size() % 2);
  EXPECT_NEAR(m.cost, cost, 1e-12 * cost);
}

template <std::size_t D>
void expect_bounds(const LargeMatching& m, const Points<D>& points) {
  expect_matching(m, points);
  const double optimum = match_points(points).cost;
  EXPECT_GE(m.cost, optimum * (1 - 1e-12));
  EXPECT_LE(m.dual_bound, optimum + 1e-11 * (1 + optimum));
  EXPECT_LE(m.dual_bound, m.cost);
}

TEST(LargeMatching, BoundsEncloseTheOptimumOfSmallSets) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t n = random() % 40;
    const int kind = static_cast<int>(seed % 5);
    LargeMatchingOptions options;
    options.exact_limit = 0;
    options.window = 4 + seed % 7;
    options.rounds = static_cast<unsigned>(seed % 4);
    const auto flat = points_of_kind<2>(kind, n, random);
    expect_bounds(match_large(flat, options), flat);
    const auto solid = points_of_kind<3>(kind, n, random);
    expect_bounds(match_large(solid, options), solid);
    // Clusters that are unrelated to position.
    std::vector<std::uint32_t> labels(n);
    for (std::uint32_t& label : labels) label = static_cast<std::uint32_t>(random() % 3) * 1000u;
    options.labels = labels;
    expect_bounds(match_large(flat, options), flat);
  }
}

TEST(LargeMatching, WindowsComeNearTheOptimum) {
  for (int kind = 0; kind < 5; kind += TERRACE_TEST_SHARE) {
    SCOPED_TRACE(testing::Message() << "kind " << kind);
    std::mt19937_64 random(17);
    LargeMatchingOptions options;
    options.exact_limit = 0;
    options.window = 500;
    const auto flat = points_of_kind<2>(kind, 6001, random);
    const LargeMatching m = match_large(flat, options);
    expect_bounds(m, flat);
    // Where many points coincide, most pairs cost nothing and a few far pairs make up the whole
    // cost.
    if (kind < 2) {
      EXPECT_LE(m.cost, 1.03 * match_points(flat).cost);
      EXPECT_LE(m.gap(), 0.12);
    }
    EXPECT_FALSE(m.optimal);
    EXPECT_GE(m.rounds, 1u);
    const auto solid = points_of_kind<3>(kind, 3000, random);
    const LargeMatching s = match_large(solid, options);
    expect_bounds(s, solid);
    if (kind < 2) {
      EXPECT_LE(s.cost, 1.01 * match_points(solid).cost);
    }
  }
}

TEST(LargeMatching, IsExactUpToTheLimit) {
  std::mt19937_64 random(3);
  const auto points = points_of_kind<2>(0, 501, random);
  LargeMatchingOptions options;
  options.exact_limit = 501;
  const LargeMatching m = match_large(points, options);
  EXPECT_TRUE(m.optimal);
  EXPECT_EQ(m.gap(), 0.0);
  EXPECT_EQ(m.mate, match_points(points).mate);
  options.exact_limit = 500;
  options.window = 100;
  EXPECT_FALSE(match_large(points, options).optimal);
  // One window for all points.
  options.window = 502;
  std::vector<std::uint32_t> labels(points.size());
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<std::uint32_t>(i % 3);
  options.labels = labels;
  const LargeMatching one_window = match_large(points, options);
  EXPECT_TRUE(one_window.optimal);
  EXPECT_EQ(one_window.rounds, 1u);
  EXPECT_NEAR(one_window.cost, m.cost, 1e-12 * m.cost);
  EXPECT_NEAR(one_window.dual_bound, m.cost, 1e-9 * m.cost);
}

TEST(LargeMatching, DoesNotDependOnThreads) {
  std::mt19937_64 random(5);
  const auto points = points_of_kind<2>(2, 4001, random);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.window = 300;
  const LargeMatching one = match_large(points, options);
  for (const unsigned threads : {2u, 5u, 0u}) {
    options.threads = threads;
    const LargeMatching many_windows = match_large(points, options);
    EXPECT_EQ(many_windows.mate, one.mate);
    EXPECT_EQ(many_windows.cost, one.cost);
    EXPECT_EQ(many_windows.dual_bound, one.dual_bound);
  }
}

TEST(LargeMatching, ClustersAreMatchedWithinThemselvesFirst) {
  std::mt19937_64 random(7);
  const auto points = points_of_kind<2>(0, 900, random);
  std::vector<std::uint32_t> labels(points.size());
  std::vector<Points<2>> clusters(3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    labels[i] = points[i][0] < 0.3 ? 7 : points[i][0] < 0.6 ? 4000000000u : 0;
    clusters[labels[i] == 7 ? 0 : labels[i] == 0 ? 1 : 2].push_back(points[i]);
  }
  LargeMatchingOptions options;
  options.labels = labels;
  options.rounds = 0;
  const LargeMatching m = match_large(points, options);
  expect_bounds(m, points);
  // Only points left over in their clusters, at most one each, are paired across clusters.
  std::size_t crossing = 0, odd = 0;
  double within = 0.0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (m.mate[i] < i) continue;
    if (labels[i] != labels[m.mate[i]]) {
      ++crossing;
    } else {
      within += length(points[i], points[m.mate[i]]);
    }
  }
  double expected = 0.0;
  for (const auto& cluster : clusters) {
    odd += cluster.size() % 2;
    expected += match_points(cluster).cost;
  }
  EXPECT_EQ(2 * crossing, odd);
  EXPECT_NEAR(within, expected, 1e-12 * expected);
  // Windows then repair the pairs at the borders.
  options.rounds = 8;
  options.window = 200;
  EXPECT_LT(match_large(points, options).cost, m.cost);
}

TEST(LargeMatching, RoundsNeverRaiseTheCost) {
  std::mt19937_64 random(9);
  const auto points = points_of_kind<2>(1, 3000, random);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.window = 100;
  options.tolerance = 0.0;
  double last_cost = std::numeric_limits<double>::infinity();
  for (options.rounds = 0; options.rounds < 7; ++options.rounds) {
    const double cost = match_large(points, options).cost;
    EXPECT_LE(cost, last_cost);
    last_cost = cost;
  }
}

TEST(LargeMatching, UsesTheCallersMetric) {
  std::mt19937_64 random(11);
  const auto points = points_of_kind<2>(0, 2001, random);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.window = 250;
  options.threads = 3;
  options.metric.distance = [&](std::uint32_t i, std::uint32_t j) {
    return std::abs(points[i][0] - points[j][0]) + std::abs(points[i][1] - points[j][1]);
  };
  const LargeMatching m = match_large(points, options);
  PointMatchingOptions exact;
  exact.metric = options.metric;
  const double optimum = match_points(points, exact).cost;
  EXPECT_GE(m.cost, optimum * (1 - 1e-12));
  EXPECT_LE(m.cost, optimum * 1.005);
  EXPECT_LE(m.dual_bound, optimum * (1 + 1e-12));
  EXPECT_LE(m.gap(), 0.1);
}

TEST(LargeMatching, HugeAndTinyCoordinatesScale) {
  std::mt19937_64 random(13);
  const auto points = points_of_kind<2>(0, 1000, random);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.window = 150;
  const LargeMatching m = match_large(points, options);
  for (const int exponent : {990, -990}) {
    auto scaled = points;
    for (auto& p : scaled) {
      for (double& c : p) c = std::ldexp(c, exponent);
    }
    const LargeMatching s = match_large(scaled, options);
    EXPECT_EQ(s.mate, m.mate);
    EXPECT_NEAR(std::ldexp(s.cost, -exponent), m.cost, 1e-12 * m.cost);
    EXPECT_NEAR(std::ldexp(s.dual_bound, -exponent), m.dual_bound, 1e-9 * m.cost);
  }
}

TEST(LargeMatching, HandlesFewerThanThreePoints) {
  LargeMatchingOptions options;
  options.exact_limit = 0;
  for (std::size_t n = 0; n < 2; ++n) {
    const LargeMatching m = match_large(Points<2>(n, {3.0, 4.0}), options);
    EXPECT_EQ(m.mate, std::vector<std::uint32_t>(n, kNone));
    EXPECT_EQ(m.left_over, n == 0 ? kNone : 0u);
    EXPECT_EQ(m.cost, 0.0);
    EXPECT_EQ(m.gap(), 0.0);
  }
  const std::vector<std::uint32_t> labels{1, 2};
  options.labels = labels;
  const LargeMatching two = match_large(Points<2>{{0, 0}, {3, 4}}, options);
  EXPECT_EQ(two.cost, 5.0);
}

TEST(LargeMatching, StopsWithACompleteMatching) {
  std::mt19937_64 random(19);
  const auto points = points_of_kind<2>(0, 3000, random);
  LargeMatchingOptions options;
  options.exact_limit = 0;
  options.window = 100;
  std::uint64_t last = 0;
  options.progress = [&](std::uint64_t done, std::uint64_t total, double) {
    EXPECT_GT(done, last);
    EXPECT_LE(done, total);
    last = done;
    return done < 5;
  };
  const LargeMatching m = match_large(points, options);
  expect_bounds(m, points);
  EXPECT_EQ(m.rounds, 0u);
  options.progress = [&](std::uint64_t, std::uint64_t, double cost) { return cost == 0.0; };
  expect_bounds(match_large(points, options), points);
  options.progress = [](std::uint64_t, std::uint64_t, double) -> bool {
    throw std::runtime_error("interrupted");
  };
  EXPECT_THROW((void)match_large(points, options), std::runtime_error);
}

TEST(LargeMatching, NamesBadInput) {
  const auto message = [](Points<2> points, const LargeMatchingOptions& options) -> std::string {
    try {
      (void)match_large(points, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  LargeMatchingOptions options;
  options.exact_limit = 0;
  Points<2> points(10, {1.0, 2.0});
  const std::vector<std::uint32_t> labels(9, 1);
  options.labels = labels;
  EXPECT_EQ(message(points, options), "match_large: 9 labels for 10 points; give one for each");
  options.labels = {};
  points[6][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(points, options).find("point 6 is not finite"), std::string::npos);
  points[6][1] = 0;
  options.window = 3;
  EXPECT_NE(message(points, options).find("window is 3"), std::string::npos);
  options.window = 4;
  options.tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(points, options).find("tolerance"), std::string::npos);
}

}  // namespace
}  // namespace terrace::matching
