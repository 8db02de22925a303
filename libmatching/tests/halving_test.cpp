// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/halving.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

namespace terrace::matching {
namespace {

std::vector<Point3> uniform(std::size_t count, std::mt19937_64& random, bool flat = true) {
  std::vector<Point3> points(count);
  for (Point3& p : points) {
    for (unsigned axis = 0; axis < (flat ? 2 : 3); ++axis) {
      p[axis] = static_cast<double>(random() >> 11) * 0x1p-53;
    }
  }
  return points;
}

double distance(const Point3& p, const Point3& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

/// Returns the optimum over all matchings, with one point left over if their number is odd.
double optimum(const std::vector<Point3>& points) {
  const auto n = points.size();
  std::vector<double> best(std::size_t{1} << n, std::numeric_limits<double>::infinity());
  best[0] = 0.0;
  if (n % 2 == 1) {
    for (std::size_t i = 0; i < n; ++i) best[std::size_t{1} << i] = 0.0;
  }
  for (std::size_t set = 0; set < best.size(); ++set) {
    if (!std::isfinite(best[set])) continue;
    for (std::size_t i = 0; i < n; ++i) {
      if (set >> i & 1) continue;
      for (std::size_t j = i + 1; j < n; ++j) {
        if (set >> j & 1) continue;
        double& value = best[set | std::size_t{1} << i | std::size_t{1} << j];
        value = std::min(value, best[set] + distance(points[i], points[j]));
      }
    }
  }
  return best.back();
}

void check(const HalvingMatching& matching, const std::vector<Point3>& points) {
  ASSERT_EQ(matching.mate.size(), points.size());
  double cost = 0.0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::uint32_t j = matching.mate[i];
    if (j == kNone) {
      EXPECT_EQ(points.size() % 2, 1u);
      EXPECT_EQ(matching.left_over, i);
      continue;
    }
    ASSERT_LT(j, points.size());
    EXPECT_NE(i, j);
    EXPECT_EQ(matching.mate[j], i);
    if (i < j) cost += distance(points[i], points[j]);
  }
  EXPECT_EQ(points.size() % 2 == 1, matching.left_over != kNone);
  EXPECT_NEAR(matching.cost, cost, 1e-12 * cost);
  for (std::size_t k = 1; k < matching.steps.size(); ++k) {
    EXPECT_LT(matching.steps[k].cost, matching.steps[k - 1].cost);
    EXPECT_GT(matching.steps[k].iteration, matching.steps[k - 1].iteration);
  }
}

TEST(Halving, MonotoneFindsTheOptimumOfFewPoints) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = uniform(2 + seed % 12, random, seed % 2 == 0);
    const HalvingMatching matching = match_by_halving(points, {.iterations = 2000, .seed = seed});
    check(matching, points);
    EXPECT_EQ(matching.iterations, 2000u);
    EXPECT_NEAR(matching.cost, optimum(points), 1e-9);
  }
}

TEST(Halving, MonteCarloFindsTheOptimumOfVeryFewPoints) {
  std::mt19937_64 random(3);
  for (const std::size_t count : {2u, 3u, 4u, 5u, 6u, 7u}) {
    const std::vector<Point3> points = uniform(count, random);
    const HalvingMatching matching =
        match_by_halving(points, {.method = Halving::monte_carlo, .iterations = 500});
    check(matching, points);
    EXPECT_NEAR(matching.cost, optimum(points), 1e-9);
  }
}

// Both methods make the same number of assignments.
TEST(Halving, MonotoneIsFarBelowMonteCarlo) {
  std::mt19937_64 random(4);
  const std::vector<Point3> points = uniform(100, random);
  const HalvingMatching published =
      match_by_halving(points, {.method = Halving::monte_carlo, .iterations = 200});
  const HalvingMatching by_halving = match_by_halving(points, {.iterations = 200});
  check(published, points);
  check(by_halving, points);
  EXPECT_GT(published.cost, 1.15 * by_halving.cost);
}

TEST(Halving, ThreadsNeverChangeTheResult) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = uniform(61, random, false);
  const HalvingOptions options{.method = Halving::monte_carlo, .iterations = 40, .seed = 9};
  const HalvingMatching one = match_by_halving(points, options);
  for (const unsigned threads : {2u, 3u, 7u}) {
    HalvingOptions shared = options;
    shared.threads = threads;
    const HalvingMatching several = match_by_halving(points, shared);
    EXPECT_EQ(several.mate, one.mate);
    EXPECT_EQ(several.cost, one.cost);
    EXPECT_EQ(several.iterations, 40u);
  }
  HalvingOptions other = options;
  other.seed = 10;
  EXPECT_NE(match_by_halving(points, other).mate, one.mate);
}

TEST(Halving, HandlesDegenerateInput) {
  for (const Halving method : {Halving::monte_carlo, Halving::monotone}) {
    const HalvingOptions options{.method = method, .iterations = 20};
    EXPECT_TRUE(match_by_halving(std::span<const Point3>{}, options).mate.empty());
    const std::vector<Point3> one{{1, 2, 3}};
    EXPECT_EQ(match_by_halving(one, options).left_over, 0u);
    const std::vector<Point3> equal(31, {5, 5, 5});
    const HalvingMatching matching = match_by_halving(equal, options);
    check(matching, equal);
    EXPECT_EQ(matching.cost, 0.0);
    const std::vector<Point3> far{{-1e150, 0, 0}, {1e150, 0, 0}, {-1e150, 1, 0}, {1e150, 1, 0}};
    check(match_by_halving(far, options), far);
  }
}

TEST(Halving, ProgressCallbackCanStopTheSearch) {
  std::mt19937_64 random(6);
  const std::vector<Point3> points = uniform(20, random);
  std::uint64_t calls = 0;
  HalvingOptions options{.iterations = 100};
  options.progress = [&](std::uint64_t done, std::uint64_t total, double cost) {
    EXPECT_EQ(done, ++calls);
    EXPECT_EQ(total, 100u);
    EXPECT_GT(cost, 0.0);
    return done < 7;
  };
  EXPECT_EQ(match_by_halving(points, options).iterations, 7u);
  EXPECT_EQ(match_by_halving(points, {.seconds = 0.0}).iterations, 1u);
}

TEST(Halving, NamesBadInput) {
  const auto message = [](const auto& run) -> std::string {
    try {
      run();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  std::vector<Point3> points{{0, 0, 0}, {1, std::nan(""), 0}};
  EXPECT_NE(message([&] { (void)match_by_halving(points); }).find("point 1"), std::string::npos);
  points[1] = {1e200, 0, 0};
  EXPECT_NE(message([&] { (void)match_by_halving(points); }).find("point 1"), std::string::npos);
  const PairDistance bad = [](std::uint32_t i, std::uint32_t j) {
    return i == 1 && j == 3 ? std::nan("") : 1.0;
  };
  EXPECT_NE(message([&] { (void)match_by_halving(4, bad, {.iterations = 50}); }).find("1 and 3"),
            std::string::npos);
  const PairDistance one = [](std::uint32_t, std::uint32_t) { return 1.0; };
  EXPECT_NE(message([&] {
              (void)match_by_halving(10'000'000, one, {.memory_limit = 1u << 30});
            }).find("MiB"),
            std::string::npos);
}

}  // namespace
}  // namespace terrace::matching
