// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/sparse_assignment.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "assignment_oracle.hpp"

namespace terrace::matching {
namespace {

// Cost in the matrix of a pair that must not be chosen.
constexpr double kAbsent = 1e6;

TEST(AssignSparse, EqualsBruteForceOrReportsInfeasibility) {
  int solved = 0, infeasible = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t rows = 1 + random() % 7, columns = 1 + random() % 7;
    const std::uint64_t density = 1 + random() % 4;
    std::vector<double> costs(rows * columns, kAbsent);
    std::vector<CostEdge> edges;
    for (std::size_t k = 0; k < rows * columns; ++k) {
      if (random() % 5 > density) continue;
      // Some pairs occur more than once. The cheapest counts.
      const std::size_t entry = random() % costs.size();
      const double cost = static_cast<double>(random() % 9) - 3.0;
      costs[entry] = std::min(costs[entry], cost);
      edges.push_back({static_cast<std::uint32_t>(entry / columns),
                       static_cast<std::uint32_t>(entry % columns), cost});
    }
    const double best = brute_force(costs, rows, columns);
    if (best > kAbsent / 2) {
      ++infeasible;
      EXPECT_THROW(assign_sparse(edges, rows, columns), std::invalid_argument);
      continue;
    }
    ++solved;
    const Assignment a = assign_sparse(edges, rows, columns);
    EXPECT_EQ(a.cost, best);
    EXPECT_EQ(check(a, edges, rows, columns), 0);
  }
  EXPECT_GT(solved, 100);
  EXPECT_GT(infeasible, 50);
}

TEST(AssignSparse, AllPairsEqualTheMatrix) {
  for (const auto& [rows, columns] : {std::pair{90, 90}, {60, 120}, {120, 60}}) {
    const auto r = static_cast<std::size_t>(rows), c = static_cast<std::size_t>(columns);
    std::mt19937_64 random(4);
    std::vector<double> costs(r * c);
    std::vector<std::size_t> begin{0};
    std::vector<std::uint32_t> column;
    for (double& cost : costs) cost = uniform(random);
    for (std::size_t i = 0; i < r; ++i) {
      for (std::uint32_t j = 0; j < c; ++j) column.push_back(j);
      begin.push_back(column.size());
    }
    const SparseCosts sparse{c, begin, column, costs};
    const Assignment a = assign_sparse(sparse), b = assign(costs, r, c);
    EXPECT_NEAR(a.cost, b.cost, 1e-12);
    EXPECT_LE(check(a, sparse), 1e-12);
    EXPECT_LE(check(a, costs, r, c), 1e-12);
    EXPECT_EQ(a.column, b.column);
  }
}

// A band: each row has its own column and its neighbours' columns.
TEST(AssignSparse, ProvesItselfOptimalOnABand) {
  for (const double scale : {1e-300, 1.0, 1e300}) {
    std::mt19937_64 random(9);
    const std::size_t n = 5000;
    std::vector<CostEdge> edges;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = i < 3 ? 0 : i - 3; j < std::min<std::size_t>(n, i + 4); ++j)
        edges.push_back({i, j, uniform(random) * scale});
    }
    std::shuffle(edges.begin(), edges.end(), random);
    const Assignment a = assign_sparse(edges, n, n);
    EXPECT_LE(check(a, edges, n, n), 1e-12 * scale * static_cast<double>(n));
  }
}

TEST(AssignSparse, NamesARowOfAHallViolator) {
  // Rows 1, 2 and 4 have only columns 0 and 3.
  const std::vector<CostEdge> edges{{0, 0, 1}, {0, 1, 1}, {0, 4, 9}, {1, 0, 2}, {1, 3, 1},
                                    {2, 3, 5}, {3, 2, 1}, {3, 1, 4}, {4, 0, 3}, {4, 3, 3}};
  const std::string message = message_of([&] { assign_sparse(edges, 5, 5); });
  EXPECT_TRUE(message.find("row 1 ") != std::string::npos ||
              message.find("row 2 ") != std::string::npos ||
              message.find("row 4 ") != std::string::npos)
      << message;
  EXPECT_NE(message.find("2 more rows have entries in only 2 columns"), std::string::npos)
      << message;
  EXPECT_NE(message_of([&] {
              assign_sparse(std::vector<CostEdge>{{0, 0, 1}, {2, 1, 1}}, 3, 3);
            }).find("row 1 has no entry"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              assign_sparse(std::vector<CostEdge>{{0, 0, 1}, {2, 0, 1}}, 3, 2);
            }).find("column 1 has no entry"),
            std::string::npos);
}

TEST(AssignSparse, NamesBadInput) {
  const auto with_edge = [](CostEdge edge) {
    return message_of([&] { assign_sparse(std::vector<CostEdge>{{0, 0, 1}, edge}, 2, 2); });
  };
  EXPECT_NE(with_edge({2, 0, 1}).find("entry 1 has row 2"), std::string::npos);
  EXPECT_NE(with_edge({1, 2, 1}).find("entry 1 has column 2"), std::string::npos);
  EXPECT_NE(with_edge({1, 1, std::nan("")}).find("entry 1"), std::string::npos);
  EXPECT_NE(with_edge({1, 1, -1e301}).find("entry 1"), std::string::npos);
  const std::vector<std::uint32_t> column{0, 1};
  const std::vector<double> cost{1, 2};
  for (const std::vector<std::size_t>& begin :
       {std::vector<std::size_t>{}, {1, 2}, {0, 1}, {0, 2, 1, 2}}) {
    EXPECT_THROW(assign_sparse(SparseCosts{2, begin, column, cost}), std::invalid_argument);
  }
}

TEST(AssignSparse, AcceptsTheEmptyProblem) {
  const std::vector<CostEdge> none;
  EXPECT_TRUE(assign_sparse(none, 0, 0).column.empty());
  EXPECT_EQ(assign_sparse(none, 0, 2).column_dual.size(), 2u);
  EXPECT_EQ(assign_sparse(none, 1, 0).column, std::vector<std::uint32_t>{kUnassigned});
}

TEST(CheckSparse, RejectsAnAbsentPair) {
  const std::vector<CostEdge> edges{{0, 0, 1}, {0, 1, 2}, {1, 1, 1}};
  Assignment a = assign_sparse(edges, 2, 2);
  EXPECT_EQ(check(a, edges, 2, 2), 0);
  std::swap(a.column[0], a.column[1]);
  EXPECT_THROW(check(a, edges, 2, 2), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::matching
