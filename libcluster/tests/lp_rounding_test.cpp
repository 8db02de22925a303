// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

const FacilityOptions kRounding{.strategy = FacilityStrategy::lp_rounding};

double bound_by(const FacilityMatrix& matrix, FacilityStrategy strategy) {
  return solve(matrix, {.strategy = strategy}).lower_bound;
}

TEST(LpRounding, ReportsThatItIsNotBuilt) {
  const std::vector<double> one{1.0};
  if (has_lp_rounding()) {
    EXPECT_NO_THROW(static_cast<void>(solve(FacilityMatrix{1, 1, one, one}, kRounding)));
    return;
  }
  try {
    static_cast<void>(solve(FacilityMatrix{1, 1, one, one}, kRounding));
    FAIL() << "it worked";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("-Dterrace_glpk=enabled"), std::string::npos);
  }
}

TEST(LpRounding, CostIsWithinTheProvenFactor) {
  if (!has_lp_rounding()) GTEST_SKIP() << "GLPK is not built in (-Dterrace_glpk=enabled)";
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 20);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    FacilityReport result;
    const FacilitySolution solution = solve(matrix, kRounding, &result);
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
  if (!has_lp_rounding()) GTEST_SKIP() << "GLPK is not built in (-Dterrace_glpk=enabled)";
  double share = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 48; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 30, 40);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    FacilityReport report;
    (void)solve(matrix, kRounding, &report);
    const double limit = report.relaxation;
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
  if (!has_lp_rounding()) GTEST_SKIP() << "GLPK is not built in (-Dterrace_glpk=enabled)";
  std::mt19937_64 random(50);
  const std::vector<Point3> points = inputs::cube(50, random);
  std::vector<double> opening(50, 0.4), connection;
  for (const Point3& a : points) {
    for (const Point3& b : points) {
      connection.push_back(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    }
  }
  const FacilityMatrix matrix{50, 50, opening, connection};
  FacilityReport result;
  const FacilitySolution solution = solve(matrix, kRounding, &result);
  laws::expect_solution(matrix, solution);
  EXPECT_LE(solution.gap(), 3.0);
  EXPECT_NEAR(lower_bound(matrix).lower_bound, result.relaxation, 0.01 * result.relaxation);
}

TEST(LpRounding, RejectsInvalidProblems) {
  EXPECT_THROW(static_cast<void>(solve(FacilityMatrix{0, 1, {}, {}}, kRounding)),
               std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
