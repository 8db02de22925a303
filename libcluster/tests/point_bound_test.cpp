// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "facility/bounds/matrix_dual.hpp"
#include "inputs.hpp"
#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;

struct Case {
  std::vector<Point3> points;
  std::vector<double> weights, channels, channel_weights;
  FacilityPoints problem;

  void refer() {
    problem.points = points;
    problem.weights = weights;
    problem.channels = {channels, channel_weights};
  }
};

std::vector<Metric> metrics() {
  const Elliptical ellipse(3.0, 0.5, 30.0);
  return {
      Euclidean{},
      SquaredEuclidean{},
      Minkowski{1.0},
      Minkowski{kInfinity},
      Minkowski{2.5},
      Minkowski{0.5},
      ellipse,
      EllipticalField({{{{-kInfinity, -kInfinity, -kInfinity}, {0.5, 0.5, kInfinity}}, ellipse}}),
      CustomMetric{[](const Point3& a, const Point3& b) {
        return std::abs(a[0] - b[0]) + 2.0 * std::abs(a[1] - b[1]);
      }}};
}

// Makes a problem. Some have weights, some a price of leaving points out, some duplicates.
// Euclidean ones have channels.
void make(Case& c, std::uint64_t seed, std::size_t max_points) {
  std::mt19937_64 random(seed);
  c.points = inputs::cube(2 + random() % (max_points - 1), random);
  if (seed % 4 == 0) {
    for (Point3& p : c.points) {
      for (double& x : p) x = std::floor(3 * x);
    }
  }
  if (seed % 3 == 0) {
    for (std::size_t i = 0; i < c.points.size(); ++i) {
      c.weights.push_back(0.1 + 9.0 * inputs::uniform(random));
    }
  }
  const std::vector<Metric> all = metrics();
  c.problem.metric = all[(seed / 4) % all.size()];
  if (std::holds_alternative<Euclidean>(c.problem.metric) && seed % 2 == 0) {
    c.channel_weights = {0.3, 0.0};
    for (std::size_t i = 0; i < 2 * c.points.size(); ++i) {
      c.channels.push_back(10.0 * inputs::uniform(random));
    }
  }
  c.problem.facility_cost = 0.05 + inputs::uniform(random);
  if (seed % 5 == 0) c.problem.outlier_price = 0.05 + 0.3 * inputs::uniform(random);
  c.refer();
}

// The problem as a matrix. If there is a price, the last facility stands for being left out at it.
struct AsMatrix {
  std::vector<double> opening, connection;
  FacilityMatrix matrix;

  explicit AsMatrix(const FacilityPoints& p) {
    const std::size_t n = p.points.size(), k = p.channels.size();
    double diagonal = terrace::cluster::diagonal(p.metric, base::box_of(p.points));
    for (std::size_t c = 0; c < k; ++c) {
      double low = kInfinity, high = -kInfinity;
      for (std::size_t i = 0; i < n; ++i) {
        low = std::min(low, p.channels.values[i * k + c]);
        high = std::max(high, p.channels.values[i * k + c]);
      }
      diagonal = std::hypot(diagonal, p.channels.weights[c] * (high - low));
    }
    const auto weight = [&](std::size_t i) { return p.weights.empty() ? 1.0 : p.weights[i]; };
    for (std::size_t j = 0; j < n; ++j) {
      opening.push_back(p.facility_cost * diagonal);
      for (std::size_t i = 0; i < n; ++i) {
        double d = distance(p.metric, p.points[j], p.points[i]);
        for (std::size_t c = 0; c < k; ++c) {
          d = std::hypot(d, p.channels.weights[c] *
                                (p.channels.values[i * k + c] - p.channels.values[j * k + c]));
        }
        connection.push_back(weight(i) * d);
      }
    }
    if (p.outlier_price < kInfinity) {
      opening.push_back(0.0);
      for (std::size_t i = 0; i < n; ++i) {
        connection.push_back(weight(i) * p.outlier_price * diagonal);
      }
    }
    matrix = {opening.size(), n, opening, connection};
  }
};

// Returns a solution to start from: each point as its own facility, or all points at the first.
FacilitySolution start_of(const FacilityPoints& p, bool one) {
  FacilitySolution start;
  for (std::uint32_t i = 0; i < p.points.size(); ++i) {
    if (!one || i == 0) start.facilities.push_back(i);
    start.assignment.push_back(one ? 0 : i);
  }
  return start;
}

TEST(PointBound, IsBelowTheOptimum) {
  double share = 0.0;
  unsigned count = 0;
  for (std::uint64_t seed = 1; seed <= 360; ++seed) {
    Case c;
    make(c, seed, 10);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << name_of(c.problem.metric));
    const AsMatrix same(c.problem);
    const double best = laws::optimum(same.matrix);
    const LowerBound bound = lower_bound(c.problem, start_of(c.problem, seed % 2 == 0));
    EXPECT_LE(bound.lower_bound, best);
    ASSERT_EQ(bound.duals.size(), c.points.size());
    // Evaluates the duals by the definition.
    const double value = dual_value(same.matrix, bound.duals);
    // Exponents below 1 amplify small rounding errors.
    const auto* power = std::get_if<Minkowski>(&c.problem.metric);
    const double slack = power && power->p < 1.0 ? 1e-5 : 1e-11;
    EXPECT_NEAR(bound.lower_bound, value, slack * static_cast<double>(c.points.size()) * best);
    if (best == 0.0) continue;
    share += bound.lower_bound / best;
    ++count;
  }
  EXPECT_GT(share / count, 0.998);  // measured: 0.9998
}

TEST(PointBound, EqualsTheBoundOfTheMatrix) {
  // The sets are larger, so that the tree has leaves to prune. Both methods reach the same limit.
  for (std::uint64_t seed = 1; seed <= 27; ++seed) {
    Case c;
    make(c, seed, 10);
    std::mt19937_64 random(seed);
    const std::size_t n = 80;
    c.points = inputs::cube(n, random);
    if (!c.weights.empty()) c.weights.resize(n, 2.0);
    c.channels.resize(n * c.channel_weights.size());
    for (double& v : c.channels) v = inputs::uniform(random);
    c.problem.facility_cost = 0.5 + 2.0 * inputs::uniform(random);
    c.refer();
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << name_of(c.problem.metric));
    const AsMatrix same(c.problem);
    const FacilitySolution found = solve(same.matrix, {.restarts = 1, .steps = 20});
    const double limit = lower_bound(same.matrix, found).lower_bound;
    FacilitySolution start;
    for (const std::uint32_t j : found.facilities) {
      if (j < n) start.facilities.push_back(j);
    }
    for (const std::uint32_t k : found.assignment) {
      start.assignment.push_back(found.facilities[k] < n ? k : kOutlier);
    }
    const LowerBound bound = lower_bound(c.problem, start, {.steps = 200});
    EXPECT_LE(bound.lower_bound, found.cost());
    EXPECT_GE(bound.lower_bound, 0.97 * limit);
    EXPECT_NEAR(bound.lower_bound, dual_value(same.matrix, bound.duals), 1e-6 * found.cost());
  }
}

TEST(PointBound, ThreadsDoNotChangeTheResult) {
  for (const bool boxes : {true, false}) {
    std::mt19937_64 random(4);
    FacilityPoints problem;
    const std::vector<Point3> points = inputs::cube(boxes ? 1500 : 200, random);
    problem.points = points;
    if (!boxes) problem.metric = metrics().back();
    FacilitySolution start = start_of(problem, false);
    const LowerBound one = lower_bound(problem, start, {.steps = 8, .threads = 1});
    for (const unsigned threads : {2u, 3u, 0u}) {
      const LowerBound many = lower_bound(problem, start, {.steps = 8, .threads = threads});
      EXPECT_EQ(many.lower_bound, one.lower_bound);
      EXPECT_EQ(many.duals, one.duals);
    }
  }
}

TEST(PointBound, HandlesHugeTinyAndFarCoordinates) {
  std::mt19937_64 random(8);
  const std::vector<Point3> unit = inputs::cube(9, random);
  for (const double scale : {1e300, 1e-300, 1.0}) {
    for (const double offset : {0.0, 1e6}) {
      SCOPED_TRACE(testing::Message() << "scale " << scale << ", offset " << offset);
      std::vector<Point3> points = unit;
      for (Point3& p : points) {
        for (double& x : p) x = scale * (x + offset);
      }
      FacilityPoints problem;
      problem.points = points;
      problem.facility_cost = 0.3;
      // The optimum of the same points moved close to the origin, where differences are exact.
      std::vector<Point3> near = points;
      for (Point3& p : near) {
        for (std::size_t a = 0; a < 3; ++a) p[a] = (p[a] - points[0][a]) / scale;
      }
      FacilityPoints twin = problem;
      twin.points = near;
      const double best = laws::optimum(AsMatrix(twin).matrix);
      const double bound =
          lower_bound(problem, start_of(problem, false), {.steps = 200}).lower_bound / scale;
      EXPECT_LE(bound, best * (1.0 + 1e-14));
      EXPECT_GE(bound, 0.9 * best);
    }
  }
}

TEST(PointBound, HandlesEqualAndSinglePoints) {
  for (const std::size_t count : {1u, 40u}) {
    const std::vector<Point3> points(count, Point3{3, 4, 5});
    FacilityPoints problem;
    problem.points = points;
    const LowerBound bound = lower_bound(problem, start_of(problem, true));
    EXPECT_EQ(bound.lower_bound, 0.0);
  }
}

TEST(PointBound, EntitiesHaveTheBoundOfTheirMatrix) {
  std::mt19937_64 random(7);
  const std::vector<Point3> points = inputs::cube(60, random);
  const double unit = diagonal(Euclidean{}, base::box_of(points));
  for (const double price : {kInfinity, 0.2}) {
    FacilityPoints by_points{.points = points, .facility_cost = 0.4, .outlier_price = price};
    const AsMatrix same(by_points);
    const FacilityEntities problem{
        .count = points.size(),
        .distance = [&](std::uint32_t f,
                        std::uint32_t c) { return distance(Euclidean{}, points[f], points[c]); },
        .facility_cost = 0.4 * unit,
        .outlier_price = price * unit};
    const FacilitySolution found = solve(problem, {.effort = Effort::full, .assign_nearest = true});
    const LowerBound bound = lower_bound(problem, found, {.steps = 200});
    EXPECT_LE(bound.lower_bound, found.cost());
    EXPECT_GE(bound.lower_bound, 0.95 * found.cost());
    EXPECT_NEAR(bound.lower_bound, dual_value(same.matrix, bound.duals), 1e-9 * found.cost());
    EXPECT_EQ(lower_bound(problem, found, {.steps = 200, .threads = 2}).duals, bound.duals);
  }
  FacilityEntities problem{.count = 3,
                           .distance = [](std::uint32_t, std::uint32_t) { return 1.0; }};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, FacilitySolution{})), std::invalid_argument);
  problem.distance = {};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, FacilitySolution{})), std::invalid_argument);
}

TEST(PointBound, RejectsInvalidInput) {
  std::mt19937_64 random(1);
  const std::vector<Point3> points = inputs::cube(5, random);
  FacilityPoints problem;
  problem.points = points;
  EXPECT_THROW(static_cast<void>(lower_bound(problem, FacilitySolution{})), std::invalid_argument);
  FacilitySolution start = start_of(problem, true);
  start.assignment[3] = kOutlier;
  EXPECT_THROW(static_cast<void>(lower_bound(problem, start)), std::invalid_argument);
  problem.outlier_price = 0.5;
  EXPECT_GT(lower_bound(problem, start).lower_bound, 0.0);
  start.facilities[0] = 5;
  EXPECT_THROW(static_cast<void>(lower_bound(problem, start)), std::invalid_argument);
  problem.metric = CustomMetric{[](const Point3&, const Point3&) { return -1.0; }};
  EXPECT_THROW(static_cast<void>(lower_bound(problem, start_of(problem, true))),
               std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
