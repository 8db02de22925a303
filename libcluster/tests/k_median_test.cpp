// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_median.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "matrix_laws.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;

TEST(KMedian, FindsTheOptimumOfSmallProblems) {
  double share = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 240; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 10, 25);
    const FacilityMatrix matrix = problem.matrix();
    const std::size_t k = 1 + seed % problem.facilities;
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind << ", k " << k);
    const FacilitySolution solution = k_median(matrix, k);
    laws::expect_solution(matrix, solution, false);
    EXPECT_EQ(solution.facilities.size(), k);
    EXPECT_EQ(solution.opening_cost, 0.0);
    const double best = laws::optimum(matrix, k);
    EXPECT_NEAR(solution.cost(), best, 1e-9 * best);
    EXPECT_LE(solution.lower_bound, best);
    if (best == 0.0) continue;
    share += solution.lower_bound / best;
    ++count;
  }
  EXPECT_GT(share / count, 0.99);  // measured: 0.9963
}

TEST(KMedian, EndsWhereNoSwapHelps) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const laws::MatrixProblem problem = laws::random_problem(seed, 60, 90);
    if (problem.facilities < 4) continue;
    const FacilityMatrix matrix = problem.matrix();
    const std::size_t k = 1 + problem.facilities / (2 + seed % 5);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << problem.kind << ", k " << k);
    const FacilitySolution solution =
        k_median(matrix, k, {.restarts = 1, .bound_steps = 20, .seed = seed});
    laws::expect_solution(matrix, solution, false);
    ASSERT_EQ(solution.facilities.size(), k);
    EXPECT_LE(solution.lower_bound, solution.cost());
    for (std::size_t leaving = 0; leaving < k; ++leaving) {
      for (std::uint32_t entering = 0; entering < matrix.facilities; ++entering) {
        double cost = 0.0;
        for (std::size_t i = 0; i < matrix.clients; ++i) {
          double least = matrix.cost(entering, i);
          for (std::size_t c = 0; c < k; ++c) {
            if (c != leaving) least = std::min(least, matrix.cost(solution.facilities[c], i));
          }
          cost += least;
        }
        ASSERT_GE(cost, solution.cost() * (1.0 - 1e-9)) << leaving << " for " << entering;
      }
    }
  }
}

// Checks the structure and costs of a solution for points, from the definitions.
void expect_medians(const FacilityPoints& problem, std::size_t k, const FacilitySolution& s) {
  ASSERT_EQ(s.facilities.size(), k);
  ASSERT_EQ(std::set<std::uint32_t>(s.facilities.begin(), s.facilities.end()).size(), k);
  ASSERT_EQ(s.assignment.size(), problem.points.size());
  for (std::uint32_t c = 0; c < k; ++c) EXPECT_EQ(s.assignment[s.facilities[c]], c);
  const double price =
      problem.outlier_price < kInfinity
          ? problem.outlier_price * diagonal(problem.metric, base::box_of(problem.points))
          : kInfinity;
  double connection = 0.0, outliers = 0.0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const double weight = problem.weights.empty() ? 1.0 : problem.weights[i];
    double least = kInfinity;
    for (const std::uint32_t j : s.facilities) {
      least = std::min(least, distance(problem.metric, problem.points[j], problem.points[i]));
    }
    if (s.assignment[i] == kOutlier) {
      EXPECT_GE(least, price * (1.0 - 1e-12));
      outliers += weight * price;
      continue;
    }
    const double own =
        distance(problem.metric, problem.points[s.facilities[s.assignment[i]]], problem.points[i]);
    EXPECT_LE(own, std::min(least, price) * (1.0 + 1e-9));
    connection += weight * own;
  }
  EXPECT_NEAR(s.connection_cost, connection, 1e-9 * connection);
  EXPECT_NEAR(s.outlier_cost, outliers, 1e-9 * outliers);
  EXPECT_EQ(s.opening_cost, 0.0);
}

TEST(KMedian, PointsEqualTheirMatrix) {
  const std::vector<Metric> metrics{
      Euclidean{}, SquaredEuclidean{}, Minkowski{1.0}, Elliptical(2.0, 0.5, 20.0),
      CustomMetric{[](const Point3& a, const Point3& b) { return std::abs(a[0] - b[0]); }}};
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<Point3> points = inputs::cube(4 + random() % 9, random);
    if (seed % 4 == 0) {
      for (Point3& p : points) {
        for (double& x : p) x = std::floor(2 * x);
      }
    }
    std::vector<double> weights;
    for (std::size_t i = 0; seed % 3 == 0 && i < points.size(); ++i) {
      weights.push_back(0.5 + 5.0 * inputs::uniform(random));
    }
    FacilityPoints problem;
    problem.points = points;
    problem.weights = weights;
    problem.metric = metrics[seed % metrics.size()];
    const std::size_t k = 1 + random() % points.size();
    SCOPED_TRACE(testing::Message()
                 << "seed " << seed << ", " << name_of(problem.metric) << ", k " << k);
    const FacilitySolution solution = k_median(problem, k, {.restarts = 12, .bound_steps = 50});
    expect_medians(problem, k, solution);
    std::vector<double> opening(points.size(), 0.0), connection;
    for (const Point3& a : points) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        connection.push_back((weights.empty() ? 1.0 : weights[i]) *
                             distance(problem.metric, a, points[i]));
      }
    }
    const double best = laws::optimum({points.size(), points.size(), opening, connection}, k);
    EXPECT_NEAR(solution.cost(), best, 1e-9 * best);
    EXPECT_LE(solution.lower_bound, best);
  }
}

TEST(KMedian, FarPointsAreLeftOutAtThePrice) {
  std::mt19937_64 random(6);
  std::vector<Point3> points = inputs::cube(60, random);
  points.push_back({40, 0, 0});
  points.push_back({0, 40, 0});
  FacilityPoints problem;
  problem.points = points;
  problem.outlier_price = 0.1;
  const FacilitySolution solution = k_median(problem, 2);
  expect_medians(problem, 2, solution);
  EXPECT_EQ(solution.assignment[60], kOutlier);
  EXPECT_EQ(solution.assignment[61], kOutlier);
  EXPECT_GT(solution.outlier_cost, 0.0);
}

TEST(KMedian, FindsSeparateClusters) {
  // There are more points than the binary search considers, in 12 clumps.
  std::mt19937_64 random(12);
  std::vector<Point3> points;
  for (std::size_t i = 0; i < 3000; ++i) {
    const double clump = static_cast<double>(i % 12);
    points.push_back({10.0 * std::floor(clump / 4.0) + inputs::uniform(random),
                      10.0 * std::fmod(clump, 4.0) + inputs::uniform(random), 0.0});
  }
  FacilityPoints problem;
  problem.points = points;
  const FacilitySolution one = k_median(problem, 12, {.restarts = 1, .bound_steps = 0});
  expect_medians(problem, 12, one);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(one.assignment[i], one.assignment[i % 12]);
  }
  for (const unsigned threads : {2u, 5u}) {
    const FacilitySolution many =
        k_median(problem, 12, {.restarts = 1, .bound_steps = 0, .threads = threads});
    EXPECT_TRUE(laws::same(one, many));
  }
}

TEST(KMedian, ThreadsDoNotChangeTheResult) {
  const laws::MatrixProblem problem = laws::random_problem(6 * 3 + 2, 120, 150);
  KMedianOptions options{.restarts = 5, .bound_steps = 10};
  const FacilitySolution one = k_median(problem.matrix(), 7, options);
  for (const unsigned threads : {2u, 3u, 0u}) {
    options.threads = threads;
    EXPECT_TRUE(laws::same(k_median(problem.matrix(), 7, options), one));
  }
}

TEST(KMedian, HandlesHugeTinyAndEqualCosts) {
  std::mt19937_64 random(2);
  const std::vector<Point3> unit = inputs::cube(40, random);
  FacilityPoints problem;
  problem.points = unit;
  const FacilitySolution plain = k_median(problem, 5);
  for (const int exponent : {1000, -1000}) {
    std::vector<Point3> points = unit;
    for (Point3& p : points) {
      for (double& x : p) x = std::ldexp(x, exponent);
    }
    problem.points = points;
    const FacilitySolution scaled = k_median(problem, 5);
    EXPECT_EQ(scaled.facilities, plain.facilities);
    EXPECT_EQ(scaled.connection_cost, std::ldexp(plain.connection_cost, exponent));
  }
  const std::vector<Point3> equal(30, Point3{1, 2, 3});
  problem.points = equal;
  const FacilitySolution all = k_median(problem, 4);
  expect_medians(problem, 4, all);
  EXPECT_EQ(all.cost(), 0.0);
  problem.points = std::span(equal).first(1);
  EXPECT_EQ(k_median(problem, 1).cost(), 0.0);
}

TEST(KMedian, RejectsInvalidInput) {
  const std::vector<double> opening{1.0, 2.0}, costs{1.0, 2.0, 3.0, 4.0};
  const FacilityMatrix matrix{2, 2, opening, costs};
  EXPECT_THROW(static_cast<void>(k_median(matrix, 0)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(k_median(matrix, 3)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(k_median(matrix, 1, {.restarts = 0})), std::invalid_argument);
  std::vector<Point3> points{{0, 0, 0}, {1, 0, 0}};
  FacilityPoints problem;
  problem.points = points;
  EXPECT_THROW(static_cast<void>(k_median(problem, 0)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(k_median(problem, 3)), std::invalid_argument);
  problem.points = {};
  EXPECT_THROW(static_cast<void>(k_median(problem, 1)), std::invalid_argument);
  points[1][2] = std::numeric_limits<double>::quiet_NaN();
  problem.points = points;
  EXPECT_THROW(static_cast<void>(k_median(problem, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
