// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/point_matching.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#include "tsplib.hpp"
#ifdef TERRACE_HAS_LEMON
#include "lemon_oracle.hpp"
#endif

namespace terrace::matching {
namespace {

using oracles::uniform;

std::vector<Point2> uniform_points(std::size_t n, std::mt19937_64& random) {
  std::vector<Point2> points(n);
  for (Point2& p : points) p = {uniform(random), uniform(random)};
  return points;
}

void expect_pairs(const PointMatching& m, std::size_t n) {
  ASSERT_EQ(m.mate.size(), n);
  std::size_t unmatched = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    if (m.mate[i] == kNone) {
      ++unmatched;
      EXPECT_EQ(m.left_over, i);
      continue;
    }
    ASSERT_LT(m.mate[i], n);
    EXPECT_NE(m.mate[i], i);
    EXPECT_EQ(m.mate[m.mate[i]], i);
  }
  EXPECT_EQ(unmatched, n % 2);
}

/// Checks that the proof of the sparse graph holds on the complete graph, as pricing must ensure.
template <std::size_t D>
void expect_optimal(const PointMatching& m, const std::vector<std::array<double, D>>& points) {
  expect_pairs(m, points.size());
  EXPECT_EQ(matching_error(m.proof, oracles::complete_graph(points)), "");
  EXPECT_NEAR(m.cost, m.dual_bound, 1e-12 * m.cost);
}

TEST(PointMatching, EqualsDynamicProgramming) {
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t n = 1 + random() % 13;
    PointMatchingOptions options;
    options.neighbours = 1 + seed % 4;
    std::vector<Point2> flat = uniform_points(n, random);
    // Every second seed uses small integers, for ties and duplicates.
    if (seed % 2 == 0) {
      for (Point2& p : flat) p = {std::floor(4 * p[0]), std::floor(4 * p[1])};
    }
    const PointMatching m = match_points(flat, options);
    expect_pairs(m, n);
    EXPECT_NEAR(m.cost, oracles::point_optimum(flat), 1e-11);
    std::vector<Point3> solid(n);
    for (Point3& p : solid) p = {uniform(random), uniform(random), uniform(random)};
    const PointMatching s = match_points(solid, options);
    expect_pairs(s, n);
    EXPECT_NEAR(s.cost, oracles::point_optimum(solid), 1e-11);
  }
}

TEST(PointMatching, IsOptimalOnTheCompleteGraph) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const std::uint32_t neighbours : {1u, 3u, 8u}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " neighbours " << neighbours);
      std::mt19937_64 random(seed);
      PointMatchingOptions options;
      options.neighbours = neighbours;
      const auto points = uniform_points(300 + seed % 2, random);
      expect_optimal(match_points(points, options), points);
    }
  }
}

TEST(PointMatching, EqualsTheCostOfLemon) {
#ifndef TERRACE_HAS_LEMON
  GTEST_SKIP() << "LEMON is not installed";
#else
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    auto points = uniform_points(200, random);
    for (Point2& p : points) {
      for (double& c : p) c = std::floor(c * (seed < 5 ? 1e6 : 10.0));
    }
    PointMatchingOptions options;
    options.metric.distance = [&](std::uint32_t i, std::uint32_t j) {
      return std::floor(oracles::distance(points[i], points[j]) + 0.5);
    };
    options.metric.offset = 0.5;
    std::vector<LemonOracle::Edge> edges;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      for (std::uint32_t j = i + 1; j < points.size(); ++j) {
        edges.push_back({i, j, static_cast<std::int64_t>(options.metric.distance(i, j))});
      }
    }
    std::int64_t cost = 0;
    ASSERT_TRUE(LemonOracle(200, edges).solve(cost));
    EXPECT_EQ(match_points(points, options).cost, static_cast<double>(cost));
  }
#endif
}

TEST(PointMatching, HandlesEqualPoints) {
  const std::vector<Point2> points(1001, Point2{3.0, -7.0});
  const PointMatching m = match_points(points);
  expect_pairs(m, points.size());
  EXPECT_EQ(m.cost, 0.0);
}

TEST(PointMatching, HandlesPointsOnALine) {
  std::mt19937_64 random(1);
  std::vector<Point2> points(400);
  for (std::size_t k = 0; k < points.size(); ++k) points[k] = {uniform(random), 0.25};
  const PointMatching m = match_points(points);
  expect_optimal(m, points);
  // On a line, pairing neighbours in sorted order is optimal.
  std::sort(points.begin(), points.end());
  double cost = 0.0;
  for (std::size_t k = 0; k < points.size(); k += 2) cost += points[k + 1][0] - points[k][0];
  EXPECT_NEAR(m.cost, cost, 1e-12);
}

TEST(PointMatching, HandlesGridsOfTies) {
  for (const std::size_t side : {20u, 21u}) {
    SCOPED_TRACE(testing::Message() << "side " << side);
    std::vector<Point2> points;
    for (std::size_t k = 0; k < side * side; ++k) {
      points.push_back({static_cast<double>(k % side), static_cast<double>(k / side)});
    }
    const PointMatching m = match_points(points);
    expect_optimal(m, points);
    EXPECT_EQ(m.cost, static_cast<double>(side * side / 2));
  }
}

// Odd clusters far apart: no list of neighbours joins them, so pricing must.
TEST(PointMatching, JoinsOddClusters) {
  std::size_t rounds = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t clusters = 2 + 2 * (seed % 3);
    std::vector<Point2> points;
    for (std::size_t c = 0; c < clusters; ++c) {
      const Point2 middle{1000.0 * uniform(random), 1000.0 * uniform(random)};
      for (std::size_t k = 0; k < 2 * (10 + random() % 40) + 1; ++k) {
        points.push_back({middle[0] + uniform(random), middle[1] + uniform(random)});
      }
    }
    PointMatchingOptions options;
    options.neighbours = 4;
    const PointMatching m = match_points(points, options);
    expect_optimal(m, points);
    rounds += m.rounds;
  }
  EXPECT_GT(rounds, 10u);
}

TEST(PointMatching, HandlesHugeAndTinyCoordinates) {
  for (const double unit : {1e300, 1e-300, 1e155, 1e-160}) {
    SCOPED_TRACE(testing::Message() << "unit " << unit);
    std::mt19937_64 random(3);
    auto points = uniform_points(120, random);
    const double plain = match_points(points).cost;
    for (Point2& p : points) p = {p[0] * unit, p[1] * unit};
    const PointMatching m = match_points(points);
    expect_pairs(m, points.size());
    EXPECT_NEAR(m.cost / unit, plain, 1e-11 * plain);
    EXPECT_NEAR(m.dual_bound / m.cost, 1.0, 1e-11);
  }
  const std::vector<Point2> ends{{-1.7e308, 0.0}, {1.7e308, 0.0}};
  EXPECT_THROW(match_points(ends), std::invalid_argument);
}

TEST(PointMatching, UsesTheCallersEdgesAndMetric) {
  std::mt19937_64 random(5);
  const auto points = uniform_points(150, random);
  const auto manhattan = [&](std::uint32_t i, std::uint32_t j) {
    return std::abs(points[i][0] - points[j][0]) + std::abs(points[i][1] - points[j][1]);
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  std::vector<WeightedEdge> edges;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    for (std::uint32_t j = i + 1; j < points.size(); ++j) {
      all.emplace_back(j, i);
      edges.push_back({i, j, manhattan(i, j)});
    }
  }
  PointMatchingOptions options;
  options.metric.distance = manhattan;
  options.neighbours = 2;
  const PointMatching priced = match_points(points, options);
  EXPECT_EQ(matching_error(priced.proof, edges), "");
  options.candidates = all;
  const PointMatching complete = match_points(points, options);
  EXPECT_EQ(complete.rounds, 1u);
  EXPECT_EQ(complete.edges, all.size());
  EXPECT_NEAR(priced.cost, complete.cost, 1e-12);
  // A factor of 0 gives no bound on the metric. The result must be the same.
  options.candidates = {};
  options.metric.factor = 0.0;
  EXPECT_NEAR(match_points(points, options).cost, complete.cost, 1e-12);
}

TEST(PointMatching, HandlesFewPoints) {
  EXPECT_TRUE(match_points(std::span<const Point2>{}).mate.empty());
  const std::vector<Point3> one{{1, 2, 3}};
  EXPECT_EQ(match_points(one).left_over, 0u);
  EXPECT_EQ(match_points(one).cost, 0.0);
  const std::vector<Point2> three{{0, 0}, {10, 0}, {1, 0}};
  EXPECT_EQ(match_points(three).left_over, 1u);
  EXPECT_EQ(match_points(three).cost, 1.0);
}

TEST(PointMatching, NamesBadInput) {
  std::vector<Point2> points{{0, 0}, {1, 1}, {2, std::nan("")}};
  try {
    match_points(points);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("point 2"), std::string::npos) << error.what();
  }
  try {
    // The size is checked before any point is read.
    match_points(std::span<const Point2>(points.data(), std::size_t{1} << 30));
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("GiB"), std::string::npos) << error.what();
  }
  points[2] = {2, 2};
  PointMatchingOptions options;
  options.neighbours = 0;
  EXPECT_THROW(match_points(points, options), std::invalid_argument);
  options.neighbours = 2;
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> outside{{0, 3}};
  options.candidates = outside;
  EXPECT_THROW(match_points(points, options), std::invalid_argument);
  options.candidates = {};
  options.metric.distance = [](std::uint32_t, std::uint32_t) { return std::nan(""); };
  EXPECT_THROW(match_points(points, options), std::invalid_argument);
  options.metric.distance = {};
  options.metric.factor = -1.0;
  EXPECT_THROW(match_points(points, options), std::invalid_argument);
}

TEST(PointMatching, IsDeterministic) {
  std::mt19937_64 random(7);
  const auto points = uniform_points(2001, random);
  const PointMatching a = match_points(points), b = match_points(points);
  EXPECT_EQ(a.mate, b.mate);
  EXPECT_EQ(a.proof.vertex_dual, b.proof.vertex_dual);
  EXPECT_EQ(a.cost, b.cost);
}

TEST(PointMatching, EqualsTheKnownOptimaOfTsplib) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  const std::string folder = std::string(data) + "/matching/";
  std::ifstream list(folder + "mwpm_optima.tsv");
  ASSERT_TRUE(list) << folder;
  std::size_t reports = 0;
  for (const auto& [name, optimum] : tsplib::read_optima(list)) {
    SCOPED_TRACE(name);
    std::ifstream file(folder + "tsplib/" + name + ".tsp");
    if (!file) continue;  // only the benchmark reads the three largest, which are compressed
    const tsplib::Instance instance = tsplib::read(file);
    PointMatchingOptions options;
    options.metric = tsplib::metric_of(instance);
    const PointMatching m = match_points(instance.points, options);
    expect_pairs(m, instance.points.size());
    EXPECT_EQ(m.cost, optimum);
    EXPECT_EQ(m.dual_bound, optimum);
    ++reports;
  }
  EXPECT_GE(reports, 30u);
}

}  // namespace
}  // namespace terrace::matching
