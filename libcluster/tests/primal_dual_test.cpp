// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

struct PrimalDual {
  FacilitySolution solution;
  std::vector<double> duals;
  double divisor;
};

PrimalDual grow(const FacilityMatrix& problem, FacilityStrategy strategy) {
  FacilityReport report;
  FacilitySolution solution = solve(problem, {.strategy = strategy}, &report);
  EXPECT_EQ(report.strategy, strategy);
  return {std::move(solution), report.duals, report.divisor};
}

PrimalDual jain_vazirani(const FacilityMatrix& problem) {
  return grow(problem, FacilityStrategy::jain_vazirani);
}

PrimalDual greedy_stars(const FacilityMatrix& problem) {
  return grow(problem, FacilityStrategy::greedy_stars);
}

double sum_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum;
}

double max_paid_share(const FacilityMatrix& matrix, const std::vector<double>& duals,
                      double divisor) {
  double most = 0.0;
  for (std::size_t j = 0; j < matrix.facilities; ++j) {
    double paid = 0.0;
    for (std::size_t i = 0; i < matrix.clients; ++i) {
      paid += std::max(0.0, duals[i] / divisor - matrix.cost(j, i));
    }
    if (paid > 0.0) most = std::max(most, paid / matrix.opening[j]);
  }
  return most;
}

TEST(PrimalDual, CostsAndBoundsAreWithinTheProvenFactors) {
  double growth_cost = 0.0, stars_cost = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 11, 25);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const double best = laws::optimum(matrix);
    const PrimalDual growth = jain_vazirani(matrix);
    const PrimalDual stars = greedy_stars(matrix);
    for (const PrimalDual* result : {&growth, &stars}) {
      laws::expect_solution(matrix, result->solution);
      EXPECT_LE(result->solution.lower_bound, best);
      EXPECT_GE(result->solution.cost(), best * (1.0 - 1e-12));
      const double bound = sum_of(result->duals) / result->divisor;
      EXPECT_NEAR(result->solution.lower_bound, bound, 1e-8 * bound);
    }
    EXPECT_EQ(growth.divisor, 1.0);
    EXPECT_LE(max_paid_share(matrix, growth.duals, 1.0), 1.0 + 1e-9);
    EXPECT_LE(max_paid_share(matrix, stars.duals, stars.divisor), 1.0 + 1e-8);
    // Duals pay for the stars, and clients then only change to cheaper facilities.
    EXPECT_LE(stars.solution.cost(), sum_of(stars.duals) * (1.0 + 1e-12));
    if (!problem.metric) continue;
    EXPECT_LE(growth.solution.cost(), 3.0 * growth.solution.lower_bound * (1.0 + 1e-9));
    EXPECT_LE(stars.divisor, 1.861);
    EXPECT_LE(stars.solution.cost(), 1.861 * stars.solution.lower_bound * (1.0 + 1e-9));
    growth_cost += growth.solution.cost() / best;
    stars_cost += stars.solution.cost() / best;
    ++count;
  }
  // On metric costs; 1.012 was measured for both.
  EXPECT_LT(growth_cost / count, 1.05);
  EXPECT_LT(stars_cost / count, 1.05);
}

TEST(PrimalDual, FollowsTheClock) {
  // Two facilities cost 3 and 4. The clients are at 1 and 2 from the first, and at 5 and 0 from the
  // second.
  const std::vector<double> opening{3.0, 4.0}, costs{1.0, 2.0, 5.0, 0.0};
  const FacilityMatrix problem{2, 2, opening, costs};
  // At time 3 the first facility has been offered 2 + 1. The second has 0 + 3, one too few.
  const PrimalDual growth = jain_vazirani(problem);
  EXPECT_EQ(growth.duals, (std::vector{3.0, 3.0}));
  EXPECT_EQ(growth.solution.facilities, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(growth.solution.cost(), 6.0);
  EXPECT_NEAR(growth.solution.lower_bound, 6.0, 1e-12);
  const PrimalDual stars = greedy_stars(problem);
  EXPECT_EQ(stars.duals, (std::vector{3.0, 3.0}));
  EXPECT_EQ(stars.solution.facilities, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(stars.divisor, 1.0);
}

TEST(PrimalDual, ClosesFacilitiesThatShareAPayer) {
  // The client in between pays for both facilities, so only the first to open stays.
  const std::vector<double> opening{2.0, 3.0}, costs{1.0, 0.5, 9.0, 9.0, 0.5, 1.0};
  const FacilityMatrix problem{2, 3, opening, costs};
  const PrimalDual growth = jain_vazirani(problem);
  EXPECT_EQ(growth.solution.facilities, (std::vector<std::uint32_t>{0}));
}

TEST(PrimalDual, HandlesEqualCostsAndFreeFacilities) {
  const std::vector<double> zeros(12, 0.0), free(3, 0.0), ones(12, 1.0), paid(3, 2.0);
  for (const auto& algorithm : {jain_vazirani, greedy_stars}) {
    EXPECT_EQ(algorithm({3, 4, free, zeros}).solution.cost(), 0.0);
    const PrimalDual equal = algorithm({3, 4, paid, ones});
    EXPECT_EQ(equal.solution.facilities, (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(equal.solution.cost(), 6.0);
    EXPECT_EQ(algorithm({1, 1, std::vector{2.0}, std::vector{3.0}}).solution.cost(), 5.0);
    EXPECT_THROW(static_cast<void>(algorithm({0, 1, {}, {}})), std::invalid_argument);
  }
}

TEST(PrimalDual, HandlesHugeAndTinyCosts) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const laws::MatrixProblem problem = laws::random_problem(seed, 8, 12);
    if (problem.kind == "sparse") continue;
    for (const auto& algorithm : {jain_vazirani, greedy_stars}) {
      const PrimalDual plain = algorithm(problem.matrix());
      for (const int exponent : {1010, -1000}) {
        laws::MatrixProblem scaled = problem;
        scaled.scale(std::ldexp(1.0, exponent));
        EXPECT_EQ(algorithm(scaled.matrix()).solution.facilities, plain.solution.facilities);
      }
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
