// SPDX-License-Identifier: GPL-3.0-or-later
#include "lp_rounding.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "matrix_laws.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

double bound_by(const FacilityMatrix& matrix, FacilityStrategy strategy) {
  return solve(matrix, {.strategy = strategy}).lower_bound;
}

TEST(LpRounding, CostIsWithinTheProvenFactor) {
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 20);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const LpRounding result = lp_rounding(matrix);
    const FacilitySolution& solution = result.solution;
    laws::expect_solution(matrix, solution);
    const double best = laws::optimum(matrix);
    EXPECT_LE(solution.lower_bound, best);
    EXPECT_GE(solution.cost(), best * (1.0 - 1e-12));
    EXPECT_LE(result.relaxation, best * (1.0 + 1e-9));
    // Strong duality.
    EXPECT_NEAR(solution.lower_bound, result.relaxation, 1e-7 * result.relaxation + 1e-12);
    if (problem.metric) {
      EXPECT_LE(solution.cost(), 4.0 * result.relaxation * (1.0 + 1e-9));
    }
  }
}

TEST(LpRounding, NoBoundIsAboveTheRelaxation) {
  double share = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 48; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 30, 40);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const double limit = lp_rounding(matrix).relaxation;
    const double most = limit * (1.0 + 1e-9);
    const double bound = lower_bound(matrix).lower_bound;
    EXPECT_LE(bound, most);
    EXPECT_LE(lower_bound(matrix, {}, {.steps = 0}).lower_bound, most);
    EXPECT_LE(bound_by(matrix, FacilityStrategy::jain_vazirani), most);
    EXPECT_LE(bound_by(matrix, FacilityStrategy::greedy_stars), most);
    if (limit == 0.0) continue;
    share += bound / limit;
    ++count;
  }
  EXPECT_GT(share / count, 0.999);  // measured: 0.99999
}

TEST(LpRounding, SolvesFiftyByFifty) {
  std::mt19937_64 random(50);
  const std::vector<Point3> points = inputs::cube(50, random);
  std::vector<double> opening(50, 0.4), connection;
  for (const Point3& a : points) {
    for (const Point3& b : points) {
      connection.push_back(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    }
  }
  const FacilityMatrix matrix{50, 50, opening, connection};
  const LpRounding result = lp_rounding(matrix);
  const FacilitySolution& solution = result.solution;
  laws::expect_solution(matrix, solution);
  EXPECT_LE(solution.gap(), 3.0);
  EXPECT_NEAR(lower_bound(matrix).lower_bound, result.relaxation, 0.01 * result.relaxation);
}

TEST(LpRounding, RejectsInvalidProblems) {
  EXPECT_THROW(static_cast<void>(lp_rounding(FacilityMatrix{0, 1, {}, {}})), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::research
