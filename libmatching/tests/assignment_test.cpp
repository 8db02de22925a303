// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/assignment.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "assignment_oracle.hpp"

namespace terrace::matching {
namespace {

template <class Cost>
class AssignTyped : public testing::Test {};
using CostTypes = testing::Types<double, float, std::int32_t>;
TYPED_TEST_SUITE(AssignTyped, CostTypes);

TYPED_TEST(AssignTyped, EqualsBruteForceOnSmallMatrices) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t columns = 1 + random() % 7, rows = 1 + random() % 7;
    std::vector<TypeParam> costs(rows * columns);
    // A few distinct values make ties common. Some are negative.
    for (auto& c : costs) c = static_cast<TypeParam>(static_cast<int>(random() % 9) - 3);
    const auto a = assign(std::span<const TypeParam>(costs), rows, columns);
    EXPECT_EQ(static_cast<double>(a.cost), brute_force(costs, rows, columns));
    EXPECT_EQ(check(a, std::span<const TypeParam>(costs), rows, columns), 0);
  }
}

TYPED_TEST(AssignTyped, EqualsBruteForceOnEightByEight) {
  std::mt19937_64 random(8);
  std::vector<TypeParam> costs(64);
  for (auto& c : costs) c = static_cast<TypeParam>(random() % 50);
  EXPECT_EQ(static_cast<double>(assign(std::span<const TypeParam>(costs), 8, 8).cost),
            brute_force(costs, 8, 8));
}

TYPED_TEST(AssignTyped, ProvesItselfOptimalOnLargerMatrices) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t rows = 1 + random() % 300, columns = 1 + random() % 300;
    std::vector<TypeParam> costs(rows * columns);
    const double range = seed % 3 == 0 ? 10 : 1e6;
    for (auto& c : costs) c = static_cast<TypeParam>(uniform(random) * range);
    const auto a = assign(std::span<const TypeParam>(costs), rows, columns);
    const auto worst = check(a, std::span<const TypeParam>(costs), rows, columns);
    EXPECT_LE(static_cast<double>(worst), std::is_integral_v<TypeParam> ? 0.0 : 1e-9 * range);
  }
}

TYPED_TEST(AssignTyped, HandlesEqualCosts) {
  for (const auto& [rows, columns] : {std::pair{70, 70}, {40, 300}, {300, 40}}) {
    const auto r = static_cast<std::size_t>(rows), c = static_cast<std::size_t>(columns);
    for (const int value : {0, -7}) {
      const std::vector<TypeParam> costs(r * c, static_cast<TypeParam>(value));
      const auto a = assign(std::span<const TypeParam>(costs), r, c);
      EXPECT_EQ(static_cast<double>(a.cost), value * static_cast<double>(std::min(r, c)));
      EXPECT_EQ(check(a, std::span<const TypeParam>(costs), r, c), 0);
    }
  }
}

// Points on a small grid, each several times: many ties and zeros.
TEST(Assign, HandlesGridsWithDuplicates) {
  for (const std::size_t columns : {120u, 90u, 150u}) {
    const std::size_t rows = 120;
    const Assignment a = assign_pairs(rows, columns, [](std::size_t i, std::size_t j) {
      return std::fabs(static_cast<double>(i % 5) - static_cast<double>(j % 7)) +
             std::fabs(static_cast<double>(i % 4) - static_cast<double>(j % 3));
    });
    std::vector<double> costs(rows * columns);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < columns; ++j)
        costs[i * columns + j] =
            std::fabs(static_cast<double>(i % 5) - static_cast<double>(j % 7)) +
            std::fabs(static_cast<double>(i % 4) - static_cast<double>(j % 3));
    }
    EXPECT_EQ(check(a, costs, rows, columns), 0);
  }
}

TEST(Assign, HandlesTinyAndHugeCosts) {
  for (const double scale : {1e-300, 1e300}) {
    std::mt19937_64 random(5);
    const std::size_t rows = 60, columns = 70;
    std::vector<double> costs(rows * columns), transposed(costs.size());
    for (double& c : costs) c = uniform(random) * scale;
    const Assignment a = assign(costs, rows, columns);
    EXPECT_LE(check(a, costs, rows, columns), 1e-13 * scale);
    for (std::size_t k = 0; k < costs.size(); ++k)
      transposed[k % columns * rows + k / columns] = costs[k];
    const Assignment b = assign(transposed, columns, rows);
    EXPECT_LE(check(b, transposed, columns, rows), 1e-13 * scale);
    EXPECT_NEAR(a.cost, b.cost, 1e-13 * scale * 60);
  }
}

TEST(Assign, IsExactForTheExtremesOf32Bits) {
  constexpr auto low = std::numeric_limits<std::int32_t>::min();
  constexpr auto high = std::numeric_limits<std::int32_t>::max();
  std::mt19937_64 random(3);
  for (const std::size_t rows : {50u, 90u}) {
    std::vector<std::int32_t> costs(rows * 70);
    for (auto& c : costs) c = random() % 3 == 0 ? low : random() % 2 == 0 ? high : 0;
    const IntegerAssignment a = assign(costs, rows, 70);
    EXPECT_EQ(check(a, costs, rows, 70), 0);
  }
}

TEST(Assign, CostsFromAFunctionEqualCostsFromAMatrix) {
  for (const std::size_t rows : {1u, 33u, 100u, 130u}) {
    std::mt19937_64 random(rows);
    const std::size_t columns = 100;
    std::vector<double> costs(rows * columns);
    for (double& c : costs) c = uniform(random);
    const auto fill = [&](std::size_t i, std::span<double> row) {
      for (std::size_t j = 0; j < columns; ++j) row[j] = costs[i * columns + j];
    };
    const Assignment a = assign(costs, rows, columns), b = assign_rows(rows, columns, fill);
    EXPECT_EQ(a.column, b.column);
    EXPECT_EQ(a.row_dual, b.row_dual);
    EXPECT_EQ(a.column_dual, b.column_dual);
    EXPECT_EQ(a.cost, b.cost);
    EXPECT_LE(check_rows(b, rows, columns, fill), 1e-12);
  }
}

TEST(Assign, ReportsUnassignedRows) {
  const std::vector<double> costs{5, 1, 7};
  const Assignment a = assign(costs, 3, 1);
  EXPECT_EQ(a.column, (std::vector<std::uint32_t>{kUnassigned, 0, kUnassigned}));
  EXPECT_EQ(a.cost, 1);
  EXPECT_EQ(check(a, costs, 3, 1), 0);
}

TEST(Assign, AcceptsTheEmptyProblem) {
  const std::vector<double> none;
  EXPECT_TRUE(assign(none, 0, 0).column.empty());
  EXPECT_EQ(assign(none, 0, 3).column_dual.size(), 3u);
  EXPECT_EQ(assign(none, 2, 0).column, (std::vector<std::uint32_t>{kUnassigned, kUnassigned}));
  EXPECT_EQ(check(assign(none, 2, 0), none, 2, 0), 0);
}

TEST(Assign, NamesBadInput) {
  std::vector<double> costs{1, 2, 3, 4};
  EXPECT_THROW(assign(costs, 1, 3), std::invalid_argument);
  EXPECT_NE(message_of([&] { assign(costs, 1, 3); }).find("4 entries"), std::string::npos);
  for (const double bad : {std::nan(""), -std::numeric_limits<double>::infinity(), 2e300}) {
    costs[2] = bad;
    EXPECT_NE(message_of([&] { assign(costs, 2, 2); }).find("row 1, column 0"), std::string::npos);
    const auto cost = [&](std::size_t i, std::size_t j) { return costs[2 * i + j]; };
    EXPECT_NE(message_of([&] { assign_pairs(2, 2, cost); }).find("row 1, column 0"),
              std::string::npos);
  }
  const std::vector<float> floats{1, std::numeric_limits<float>::infinity()};
  EXPECT_NE(message_of([&] { assign(floats, 1, 2); }).find("row 0, column 1"), std::string::npos);
  EXPECT_THROW(assign(costs, std::size_t{1} << 32, 1), std::invalid_argument);
  EXPECT_THROW(assign_rows(2, 2, CostRow()), std::bad_function_call);
}

TEST(Check, DetectsEveryViolation) {
  const std::vector<double> costs{1, 5, 9, 4, 2, 9};
  const Assignment right = assign(costs, 2, 3);
  ASSERT_EQ(check(right, costs, 2, 3), 0);
  const auto spoiled = [&](const auto& spoil) {
    Assignment a = right;
    spoil(a);
    return check(a, costs, 2, 3);
  };
  EXPECT_EQ(spoiled([](Assignment& a) { a.cost += 0.5; }), 0.5);
  EXPECT_EQ(spoiled([](Assignment& a) { a.row_dual[1] -= 0.25; }), 0.25);
  EXPECT_EQ(spoiled([](Assignment& a) { a.row_dual[0] += 0.25; }), 0.25);
  EXPECT_EQ(spoiled([](Assignment& a) { a.column_dual[2] = -0.125; }), 0.125);
  EXPECT_GT(spoiled([](Assignment& a) { std::swap(a.column[0], a.column[1]); }), 0);
  EXPECT_TRUE(std::isnan(spoiled([](Assignment& a) { a.row_dual[0] = std::nan(""); })));
  EXPECT_THROW(spoiled([](Assignment& a) { a.column[1] = a.column[0]; }), std::invalid_argument);
  EXPECT_THROW(spoiled([](Assignment& a) { a.column[1] = 3; }), std::invalid_argument);
  EXPECT_THROW(spoiled([](Assignment& a) { a.column[1] = kUnassigned; }), std::invalid_argument);
  EXPECT_THROW(spoiled([](Assignment& a) { a.row_dual.pop_back(); }), std::invalid_argument);
}

// The published optimum of an OR-Library instance.
TEST(Assign, FindsThePublishedOptimum) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA names no data folder";
  std::ifstream file(std::string(data) + "/matching/assignment/assign500.txt");
  std::size_t n = 0;
  ASSERT_TRUE(file >> n);
  ASSERT_EQ(n, 500u);
  std::vector<std::int32_t> costs(n * n);
  for (auto& c : costs) ASSERT_TRUE(file >> c);
  const IntegerAssignment a = assign(costs, n, n);
  EXPECT_EQ(a.cost, 991);
  EXPECT_EQ(check(a, costs, n, n), 0);
  const std::vector<double> real_costs(costs.begin(), costs.end());
  EXPECT_EQ(assign(real_costs, n, n).cost, 991);
}

}  // namespace
}  // namespace terrace::matching
