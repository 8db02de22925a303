// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/matching.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#ifdef TERRACE_HAS_LEMON
#include "lemon_oracle.hpp"
#endif

namespace terrace::matching {
namespace {

std::vector<IntegerEdge> random_graph(std::uint32_t n, double density, std::int64_t values,
                                      std::int64_t least, std::mt19937_64& random) {
  std::vector<IntegerEdge> edges;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = i + 1; j < n; ++j) {
      if (oracles::uniform(random) >= density) continue;
      const auto step = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(values));
      edges.push_back({i, j, least + step});
    }
  }
  return edges;
}

double subset_optimum(std::size_t n, const std::vector<IntegerEdge>& edges) {
  std::vector<double> weight(n * n, std::numeric_limits<double>::infinity());
  for (const IntegerEdge& e : edges) {
    double& w = weight[e.i * n + e.j];
    w = weight[e.j * n + e.i] = std::min(w, static_cast<double>(e.weight));
  }
  return oracles::subset_optimum(weight, n);
}

TEST(Matching, EqualsDynamicProgrammingOnSmallGraphs) {
  int infeasible = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const auto n = static_cast<std::uint32_t>(2 * (1 + random() % 6));
    // Few distinct values cause ties and blossoms of dual 0. Negative values are allowed.
    const auto values = static_cast<std::int64_t>(1 + random() % 20);
    const auto edges = random_graph(n, 0.2 + 0.8 * oracles::uniform(random), values,
                                    -static_cast<std::int64_t>(random() % 10), random);
    const double optimum = subset_optimum(n, edges);
    if (std::isinf(optimum)) {
      ++infeasible;
      EXPECT_THROW(min_weight_perfect_matching(n, edges), std::invalid_argument);
      continue;
    }
    const Matching m = min_weight_perfect_matching(n, edges);
    EXPECT_EQ(m.cost, optimum);
    EXPECT_EQ(m.dual_bound(), optimum);
    EXPECT_EQ(matching_error(m, edges), "");
  }
  EXPECT_GT(infeasible, 100);
}

// Dense graphs with many triangles and few distinct values make nested blossoms that shrink and
// expand.
TEST(Matching, ProvesItselfOptimalOnLargerGraphs) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::uint32_t n = 100 + 20 * static_cast<std::uint32_t>(random() % 10);
    const std::int64_t values = seed % 3 == 0 ? 3 : seed % 3 == 1 ? 1000 : std::int64_t{1} << 40;
    auto edges = random_graph(n, seed % 2 == 0 ? 0.05 : 0.5, values, 1, random);
    for (std::uint32_t v = 0; v < n; v += 2) edges.push_back({v, v + 1, 10 * values});
    const Matching m = min_weight_perfect_matching(n, edges);
    EXPECT_EQ(matching_error(m, edges), "");
    EXPECT_EQ(m.cost, m.dual_bound());
#ifdef TERRACE_HAS_LEMON
    std::vector<LemonOracle::Edge> same;
    for (const IntegerEdge& e : edges) same.push_back({e.i, e.j, e.weight});
    std::int64_t cost = 0;
    ASSERT_TRUE(LemonOracle(n, same).solve(cost));
    EXPECT_EQ(m.cost, static_cast<double>(cost));
#endif
  }
#ifndef TERRACE_HAS_LEMON
  GTEST_SKIP() << "LEMON is not installed: only the duals were checked";
#endif
}

TEST(Matching, RoundsDoublesAsDocumented) {
  for (const double unit : {1.0, 1e-300, 1e290, 5e-324}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " unit " << unit);
      std::mt19937_64 random(seed);
      const std::uint32_t n = 12;
      std::vector<WeightedEdge> edges;
      std::vector<double> weight(n * n, std::numeric_limits<double>::infinity());
      for (const IntegerEdge& e : random_graph(n, 1.0, std::int64_t{1} << 50, 1, random)) {
        const double w = static_cast<double>(e.weight) * (unit < 1e-320 ? unit : unit * 0x1p-50);
        edges.push_back({e.i, e.j, w});
        weight[e.i * n + e.j] = weight[e.j * n + e.i] = w;
      }
      const Matching m = min_weight_perfect_matching(n, edges);
      EXPECT_EQ(matching_error(m, edges), "");
      const double optimum = oracles::subset_optimum(weight, n);
      EXPECT_LE(m.cost, optimum * (1.0 + 1e-12));
      EXPECT_NEAR(m.dual_bound() / optimum, 1.0, 1e-12);
    }
  }
}

TEST(Matching, TakesTheLeastOfParallelEdges) {
  const std::vector<WeightedEdge> edges{{0, 1, 3.0}, {1, 0, 2.0}, {0, 1, 5.0}};
  const Matching m = min_weight_perfect_matching(2, edges);
  EXPECT_EQ(m.cost, 2.0);
  EXPECT_EQ(matching_error(m, edges), "");
}

TEST(Matching, AcceptsAnEmptyGraph) {
  EXPECT_TRUE(min_weight_perfect_matching(0, std::span<const WeightedEdge>{}).mate.empty());
}

std::string matching_message(std::size_t n, const std::vector<WeightedEdge>& edges) {
  try {
    min_weight_perfect_matching(n, edges);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Matching, NamesBadInput) {
  EXPECT_NE(matching_message(3, {{0, 1, 1}}).find("odd"), std::string::npos);
  EXPECT_NE(matching_message(2, {{0, 1, 1}, {1, 1, 1}}).find("edge 1 joins 1 and 1"),
            std::string::npos);
  EXPECT_NE(matching_message(std::size_t{1} << 40, {}).find("GB"), std::string::npos);
  EXPECT_NE(matching_message(2, {{0, 2, 1}}).find("edge 0"), std::string::npos);
  EXPECT_NE(matching_message(2, {{0, 1, std::nan("")}}).find("edge 0"), std::string::npos);
  EXPECT_NE(matching_message(2, {{0, 1, INFINITY}}).find("edge 0"), std::string::npos);
  EXPECT_NE(matching_message(2, {}).find("vertex 0 cannot be matched"), std::string::npos);
  // A star: without its centre the three leaves are odd components.
  const std::string star = matching_message(4, {{0, 3, 1}, {1, 3, 1}, {2, 3, 1}});
  EXPECT_NE(star.find("removing the 1 vertices {3} leaves 2 components"), std::string::npos)
      << star;
  const std::vector<IntegerEdge> heavy{{0, 1, std::numeric_limits<std::int64_t>::max()}};
  EXPECT_THROW(min_weight_perfect_matching(2, heavy), std::invalid_argument);
}

// Tests the checker itself: it must detect each violated condition.
TEST(Matching, DetectsForgedProofs) {
  // Two triangles joined by one long edge. Each triangle is a blossom with a dual.
  const std::vector<IntegerEdge> edges{{0, 1, 2}, {1, 2, 2}, {0, 2, 2}, {3, 4, 2},
                                       {4, 5, 2}, {3, 5, 2}, {2, 3, 9}};
  const Matching good = min_weight_perfect_matching(6, edges);
  ASSERT_EQ(matching_error(good, edges), "");
  EXPECT_EQ(good.cost, 13.0);
  EXPECT_GT(*std::max_element(good.blossom_dual.begin(), good.blossom_dual.end()), 0);
  Matching bad = good;
  ++bad.vertex_dual[0];
  EXPECT_NE(matching_error(bad, edges), "");
  bad = good;
  --bad.vertex_dual[0];
  EXPECT_NE(matching_error(bad, edges), "");
  bad = good;
  std::swap(bad.mate[0], bad.mate[3]);
  EXPECT_NE(matching_error(bad, edges), "");
  bad = good;
  bad.blossom_dual[0] = -bad.blossom_dual[0] - 1;
  EXPECT_NE(matching_error(bad, edges), "");
  bad = good;
  bad.vertex_blossom[0] = kNone;
  EXPECT_NE(matching_error(bad, edges), "");
}

}  // namespace
}  // namespace terrace::matching
