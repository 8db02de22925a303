// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "facility/bounds/matrix_dual.hpp"
#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

TEST(LowerBound, IsBelowTheOptimum) {
  double ascent_share = 0.0, share = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 25);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const double best = laws::optimum(problem.matrix());
    const LowerBound ascent = lower_bound(problem.matrix(), {}, {.steps = 0});
    const LowerBound bound = lower_bound(problem.matrix(), {}, {.steps = 200});
    // Without any tolerance: the bound is rounded down, the optimum is not.
    EXPECT_LE(ascent.lower_bound, best);
    EXPECT_LE(bound.lower_bound, best);
    EXPECT_GE(bound.lower_bound, ascent.lower_bound);
    EXPECT_EQ(dual_value(problem.matrix(), bound.duals), bound.lower_bound);
    if (best == 0.0) continue;
    ascent_share += ascent.lower_bound / best;
    share += bound.lower_bound / best;
    ++count;
  }
  // Measured: 0.99898 and 0.99933.
  EXPECT_GT(ascent_share / count, 0.997);
  EXPECT_GT(share / count, 0.998);
}

TEST(LowerBound, DualsOfTheAscentAreFeasible) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 30, 50);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const LowerBound bound = lower_bound(matrix, {}, {.steps = 0});
    double sum = 0.0;
    for (const double v : bound.duals) sum += v;
    for (std::size_t j = 0; j < matrix.facilities; ++j) {
      double paid = 0.0;
      for (std::size_t i = 0; i < matrix.clients; ++i) {
        paid += std::max(0.0, bound.duals[i] - matrix.cost(j, i));
      }
      EXPECT_LE(paid, matrix.opening[j] + 1e-12 * sum);
    }
    EXPECT_NEAR(bound.lower_bound, sum, 1e-9 * sum);
  }
}

TEST(LowerBound, HoldsForAnyDuals) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 8, 12);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    std::mt19937_64 random(seed);
    const double best = laws::optimum(problem.matrix());
    for (int k = 0; k < 20; ++k) {
      std::vector<double> duals(problem.clients);
      for (double& v : duals) v = 4.0 * inputs::uniform(random) - 1.0;
      EXPECT_LE(dual_value(problem.matrix(), duals), best);
    }
  }
}

TEST(LowerBound, ProvesOptimaWithoutAGap) {
  // Clients and facilities are on a line, one facility per client. The relaxation has no gap there.
  std::vector<double> opening(12), connection(144);
  std::mt19937_64 random(3);
  std::vector<double> at(12);
  for (double& x : at) x = inputs::uniform(random);
  for (std::size_t j = 0; j < 12; ++j) {
    opening[j] = 0.05 + 0.1 * inputs::uniform(random);
    for (std::size_t i = 0; i < 12; ++i) connection[j * 12 + i] = std::abs(at[j] - at[i]);
  }
  const FacilityMatrix problem{12, 12, opening, connection};
  FacilitySolution solution = solve(problem);
  solution.lower_bound = lower_bound(problem, solution).lower_bound;
  EXPECT_GE(solution.gap(), 0.0);
  EXPECT_LT(solution.gap(), 1e-6);
  EXPECT_NEAR(solution.cost(), laws::optimum(problem), 1e-12);
}

TEST(LowerBound, ThreadsDoNotChangeTheResult) {
  const laws::MatrixProblem problem = laws::random_problem(6 * 9 + 2, 400, 120);
  const LowerBound one = lower_bound(problem.matrix(), {}, {.steps = 30, .threads = 1});
  for (const unsigned threads : {2u, 5u, 0u}) {
    const LowerBound many = lower_bound(problem.matrix(), {}, {.steps = 30, .threads = threads});
    EXPECT_EQ(many.lower_bound, one.lower_bound);
    EXPECT_EQ(many.duals, one.duals);
  }
}

TEST(LowerBound, HandlesHugeAndTinyCosts) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const laws::MatrixProblem problem = laws::random_problem(seed, 8, 12);
    if (problem.kind == "sparse") continue;
    for (const int exponent : {1010, -1000}) {
      laws::MatrixProblem scaled = problem;
      scaled.scale(std::ldexp(1.0, exponent));
      const double best = laws::optimum(scaled.matrix());
      const LowerBound bound = lower_bound(scaled.matrix(), {}, {.steps = 100});
      EXPECT_LE(bound.lower_bound, best);
      if (best > 0.0) {
        EXPECT_GE(bound.lower_bound, 0.7 * best);
      }
    }
  }
}

TEST(LowerBound, RejectsInvalidInput) {
  const std::vector<double> opening{1.0, 2.0}, costs{1.0, 2.0, 3.0, 4.0};
  const FacilityMatrix problem{2, 2, opening, costs};
  EXPECT_THROW(static_cast<void>(dual_value(problem, std::vector{1.0})), std::invalid_argument);
  const std::vector<double> missing{1.0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THROW(static_cast<void>(dual_value(problem, missing)), std::invalid_argument);
  FacilitySolution other;
  other.facilities = {2};
  other.assignment = {0, 0};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, other)), std::invalid_argument);
  other.facilities = {1};
  other.assignment = {0};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, other)), std::invalid_argument);
  other.assignment = {0, kOutlier};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, other)), std::invalid_argument);
  const FacilityMatrix empty{0, 0, {}, {}};
  EXPECT_THROW(static_cast<void>(lower_bound(empty)), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
