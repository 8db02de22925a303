// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/assignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::matching {
namespace {

double brute_force(const std::vector<double>& costs, std::size_t rows, std::size_t columns) {
  std::vector<std::size_t> permutation(columns);
  std::iota(permutation.begin(), permutation.end(), std::size_t{0});
  double best = std::numeric_limits<double>::infinity();
  do {
    double sum = 0;
    for (std::size_t i = 0; i < rows; ++i) sum += costs[i * columns + permutation[i]];
    best = std::min(best, sum);
  } while (std::next_permutation(permutation.begin(), permutation.end()));
  return best;
}

// Optimality by complementary slackness: needs no second solver.
void expect_optimal(const Assignment& a, const std::vector<double>& costs, std::size_t rows,
                    std::size_t columns, double tolerance) {
  std::vector<bool> used(columns, false);
  ASSERT_EQ(a.column.size(), rows);
  for (std::size_t i = 0; i < rows; ++i) {
    ASSERT_LT(a.column[i], columns);
    EXPECT_FALSE(used[a.column[i]]) << "column " << a.column[i] << " twice";
    used[a.column[i]] = true;
    EXPECT_NEAR(a.row_dual[i] + a.column_dual[a.column[i]], costs[i * columns + a.column[i]],
                tolerance);
    for (std::size_t j = 0; j < columns; ++j) {
      EXPECT_LE(a.row_dual[i] + a.column_dual[j], costs[i * columns + j] + tolerance);
    }
  }
  for (std::size_t j = 0; j < columns; ++j) {
    EXPECT_LE(a.column_dual[j], tolerance);
    if (!used[j]) {
      EXPECT_EQ(a.column_dual[j], 0.0);
    }
  }
}

TEST(Assign, EqualsBruteForceOnSmallMatrices) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t columns = 1 + random() % 7, rows = 1 + random() % columns;
    std::vector<double> costs(rows * columns);
    // A few distinct values, so that ties are common; negative ones too.
    for (double& c : costs) c = static_cast<double>(random() % 9) - 3.0;
    const Assignment a = assign(costs, rows, columns);
    EXPECT_EQ(a.cost, brute_force(costs, rows, columns));
    expect_optimal(a, costs, rows, columns, 0.0);
  }
}

TEST(Assign, ProvesItselfOptimalOnLargerMatrices) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t rows = 150, columns = 150 + 20 * (seed - 1);
    std::vector<double> costs(rows * columns);
    for (double& c : costs) c = static_cast<double>(random() >> 11) * 0x1p-53;
    expect_optimal(assign(costs, rows, columns), costs, rows, columns, 1e-12);
  }
}

TEST(Assign, AcceptsTheEmptyProblem) {
  EXPECT_TRUE(assign({}, 0, 0).column.empty());
  EXPECT_EQ(assign({}, 0, 3).column_dual.size(), 3u);
}

TEST(Assign, NamesWhatIsWrong) {
  const std::vector<double> bad{1, 2, std::nan(""), 4};
  EXPECT_THROW(assign(bad, 2, 2), std::invalid_argument);
  const std::vector<double> good{1, 2, 3, 4};
  EXPECT_THROW(assign(good, 4, 1), std::invalid_argument);
  EXPECT_THROW(assign(good, 1, 3), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::matching
