// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>

#include "facility/matrix/cost_rows.hpp"
#include "facility/matrix/matrix_search.hpp"
#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

const FacilityOptions kFew{.restarts = 2, .steps = 20};

TEST(Interchange, FindsTheOptimumOfSmallProblems) {
  for (std::uint64_t seed = 1; seed <= 240; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 25);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilitySolution solution = solve(problem.matrix(), kFew);
    laws::expect_solution(problem.matrix(), solution);
    const double best = laws::optimum(problem.matrix());
    EXPECT_NEAR(solution.cost(), best, 1e-9 * best);
  }
}

TEST(Interchange, GainEqualsTheSaving) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 40, 60);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const base::StopCheck never;
    const MatrixRows costs(matrix, never);
    MatrixSearch search(costs, costs.opening());
    std::mt19937_64 random(seed);
    const auto first = static_cast<std::uint32_t>(random() % problem.facilities);
    search.reset(std::span(&first, 1));
    for (int step = 0; step < 60; ++step) {
      const auto candidate = static_cast<std::uint32_t>(random() % problem.facilities);
      if (search.state().is_open(candidate)) continue;
      const double before = search.cost();
      const double gain = search.gain(candidate);
      // Also opens candidates that raise the cost, because the gain must be right whatever its
      // sign. Clients of closed facilities may find a nearer one than assumed.
      search.open(candidate);
      ASSERT_LE(search.cost(), before - gain + 1e-9 * before);
      if (search.closings().size() <= 1) {
        ASSERT_NEAR(before - search.cost(), gain, 1e-9 * before);
      }
      // The nearest and second nearest must match a scan.
      for (std::uint32_t i = 0; i < problem.clients; ++i) {
        std::vector<double> all;
        for (const std::uint32_t j : search.state().facilities()) all.push_back(costs.cost(j, i));
        std::sort(all.begin(), all.end());
        ASSERT_EQ(search.state().first_cost()[i], all[0]);
        ASSERT_EQ(search.state().second_cost()[i],
                  all.size() > 1 ? all[1] : std::numeric_limits<double>::infinity());
        ASSERT_EQ(costs.cost(search.state().first()[i], i), all[0]);
      }
    }
  }
}

TEST(Interchange, EndsWhereNoSingleMoveHelps) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 20, 40);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind);
    const FacilityMatrix matrix = problem.matrix();
    const FacilitySolution solution = solve(matrix, {.restarts = 1, .steps = 0});
    const auto cost = [&](const std::vector<bool>& open) {
      std::vector<std::uint32_t> list;
      for (std::uint32_t j = 0; j < open.size(); ++j) {
        if (open[j]) list.push_back(j);
      }
      return list.empty() ? std::numeric_limits<double>::infinity()
                          : solution_of(matrix, list).cost();
    };
    std::vector<bool> open(problem.facilities, false);
    for (const std::uint32_t j : solution.facilities) open[j] = true;
    const double least = solution.cost() * (1.0 - 1e-9);
    for (std::size_t a = 0; a < open.size(); ++a) {
      open[a] = !open[a];
      EXPECT_GE(cost(open), least) << "opening or closing " << a;
      for (std::size_t b = 0; b < a; ++b) {
        // `a` has changed: one of the two opens and the other closes.
        if (open[a] != open[b]) continue;
        open[b] = !open[b];
        EXPECT_GE(cost(open), least) << "exchanging " << a << " and " << b;
        open[b] = !open[b];
      }
      open[a] = !open[a];
    }
  }
}

TEST(Interchange, ThreadsDoNotChangeTheResult) {
  const laws::MatrixProblem problem = laws::random_problem(6 * 7, 80, 120);
  FacilityOptions options{.restarts = 5, .steps = 5, .seed = 9, .threads = 1};
  const FacilitySolution one = solve(problem.matrix(), options);
  for (const unsigned threads : {2u, 3u, 8u, 0u}) {
    options.threads = threads;
    EXPECT_TRUE(laws::same(solve(problem.matrix(), options), one)) << threads;
  }
}

TEST(Interchange, HandlesHugeAndTinyCosts) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    laws::MatrixProblem problem = laws::random_problem(seed, 10, 20);
    if (problem.kind == "sparse") continue;
    const FacilitySolution plain = solve(problem.matrix(), kFew);
    for (const int exponent : {1015, -1000}) {
      laws::MatrixProblem scaled = problem;
      scaled.scale(std::ldexp(1.0, exponent));
      const FacilitySolution solution = solve(scaled.matrix(), kFew);
      EXPECT_EQ(solution.facilities, plain.facilities);
      EXPECT_EQ(solution.assignment, plain.assignment);
    }
  }
}

TEST(Interchange, HandlesEqualCostsAndFreeFacilities) {
  const std::vector<double> zeros(12, 0.0), opening(3, 0.0), ones(12, 1.0), paid(3, 2.0);
  const FacilitySolution free = solve(FacilityMatrix{3, 4, opening, zeros});
  EXPECT_EQ(free.cost(), 0.0);
  EXPECT_EQ(free.gap(), 0.0);
  const FacilitySolution equal = solve(FacilityMatrix{3, 4, paid, ones});
  EXPECT_EQ(equal.facilities.size(), 1u);
  EXPECT_EQ(equal.cost(), 6.0);
  const FacilitySolution single = solve(FacilityMatrix{1, 1, std::vector{2.0}, std::vector{3.0}});
  EXPECT_EQ(single.cost(), 5.0);
}

TEST(Interchange, RejectsInvalidProblems) {
  const std::vector<double> opening{1.0, 2.0};
  std::vector<double> costs{1.0, 2.0, 3.0, -1.0};
  try {
    static_cast<void>(solve(FacilityMatrix{2, 2, opening, costs}));
    FAIL() << "a negative cost was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("client 1 to facility 1"), std::string::npos)
        << error.what();
  }
  costs[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(solve(FacilityMatrix{2, 2, opening, costs})),
               std::invalid_argument);
  costs[3] = 4.0;
  EXPECT_THROW(static_cast<void>(solve(FacilityMatrix{0, 2, {}, {}})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(solve(FacilityMatrix{2, 2, opening, costs}, {.restarts = 0})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(solve(FacilityMatrix{2, 2, opening, costs},
                                       {.seconds = std::numeric_limits<double>::quiet_NaN()})),
               std::invalid_argument);
}

TEST(Interchange, TimeLimitEndsTheSearch) {
  const laws::MatrixProblem problem = laws::random_problem(6 * 5, 30, 60);
  const FacilitySolution solution =
      solve(problem.matrix(), {.restarts = 2, .steps = 4000000000u, .seconds = 0.02});
  laws::expect_solution(problem.matrix(), solution);
}

}  // namespace
}  // namespace terrace::cluster
