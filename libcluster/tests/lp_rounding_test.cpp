// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/lp_rounding.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "matrix_laws.hpp"
#include "terrace/cluster/lower_bound.hpp"
#include "terrace/cluster/primal_dual.hpp"

namespace terrace::cluster {
namespace {

TEST(LpRounding, SaysSoWhereItIsNotBuilt) {
  const std::vector<double> one{1.0};
  if (has_lp_rounding()) {
    EXPECT_NO_THROW(static_cast<void>(lp_rounding({1, 1, one, one})));
    return;
  }
  try {
    static_cast<void>(lp_rounding({1, 1, one, one}));
    FAIL() << "it worked";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("-Dterrace_glpk=enabled"), std::string::npos);
  }
}

TEST(LpRounding, KeepsItsPromises) {
  if (!has_lp_rounding()) GTEST_SKIP() << "GLPK is not built in (-Dterrace_glpk=enabled)";
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 20);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const LpRounding result = lp_rounding(matrix);
    laws::expect_solution(matrix, result.solution);
    const double best = laws::optimum(matrix);
    EXPECT_LE(result.solution.lower_bound, best);
    EXPECT_GE(result.solution.cost(), best * (1.0 - 1e-12));
    EXPECT_LE(result.relaxation, best * (1.0 + 1e-9));
    // Strong duality.
    EXPECT_NEAR(result.solution.lower_bound, result.relaxation, 1e-7 * result.relaxation + 1e-12);
    if (problem.metric) {
      EXPECT_LE(result.solution.cost(), 4.0 * result.relaxation * (1.0 + 1e-9));
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
    const double limit = lp_rounding(matrix).relaxation;
    const double most = limit * (1.0 + 1e-9);
    const double bound = lower_bound(matrix).lower_bound;
    EXPECT_LE(bound, most);
    EXPECT_LE(dual_ascent(matrix).lower_bound, most);
    EXPECT_LE(jain_vazirani(matrix).solution.lower_bound, most);
    EXPECT_LE(greedy_stars(matrix).solution.lower_bound, most);
    if (limit == 0.0) continue;
    share += bound / limit;
    ++count;
  }
  EXPECT_GT(share / count, 0.999);  // measured: 0.99999
}

TEST(LpRounding, FiftyByFifty) {
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
  const LpRounding result = lp_rounding(matrix);
  laws::expect_solution(matrix, result.solution);
  EXPECT_LE(result.solution.gap(), 3.0);
  EXPECT_NEAR(lower_bound(matrix).lower_bound, result.relaxation, 0.01 * result.relaxation);
}

TEST(LpRounding, RefusesWhatIsNoProblem) {
  EXPECT_THROW(static_cast<void>(lp_rounding({0, 1, {}, {}})), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
