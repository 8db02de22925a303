// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <gtest/gtest.h>

#include "facility/matrix/strategies.hpp"
#include "facility/points/local_search.hpp"
#include "inputs.hpp"
#include "search_laws.hpp"

namespace terrace::cluster {
namespace {

TEST(CostMatrix, HoldsTheWeightedDistancesOfAllPairs) {
  std::mt19937_64 random(3);
  const std::vector<Point3> points = inputs::cube(40, random);
  std::vector<double> weights(points.size()), values(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    weights[i] = 0.5 + inputs::uniform(random);
    values[i] = 3.0 * inputs::uniform(random);
  }
  const std::vector<double> channel_weights{0.5};
  const std::vector<Metric> metrics{
      Euclidean{}, SquaredEuclidean{}, Minkowski{3.0}, Elliptical(2.0, 0.5, 20.0),
      EllipticalField({{{{0, 0, 0}, {0.5, 1, 1}}, Elliptical(3.0, 0.5, 20.0)}})};
  for (const Metric& metric : metrics) {
    for (const double scale : {1.0, 1e100, 1e-100}) {
      if (scale != 1.0 && std::holds_alternative<EllipticalField>(metric)) continue;
      SCOPED_TRACE(name_of(metric) + " at " + std::to_string(scale));
      std::vector<Point3> scaled = points;
      for (Point3& p : scaled) {
        for (double& x : p) x *= scale;
      }
      const CostMatrix matrix =
          cost_matrix(FacilityPoints{.points = scaled, .weights = weights, .metric = metric}, 0);
      ASSERT_EQ(matrix.connection.size(), points.size() * points.size());
      for (std::size_t j = 0; j < points.size(); ++j) {
        EXPECT_NEAR(matrix.opening[j] / diagonal(metric, base::box_of(scaled)), 1.0, 1e-12);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double expected = weights[i] * distance(metric, scaled[j], scaled[i]);
          EXPECT_NEAR(matrix.view().cost(j, i), expected, 1e-12 * expected);
        }
      }
    }
  }
  // Channels are one more axis.
  const CostMatrix matrix =
      cost_matrix(FacilityPoints{.points = points, .channels = {values, channel_weights}}, 0);
  const double flat = distance(Euclidean{}, points[3], points[7]);
  EXPECT_NEAR(matrix.view().cost(3, 7), std::hypot(flat, 0.5 * (values[3] - values[7])), 1e-12);
}

// The cost of a solution found through the matrix must equal the cost that the search on points
// computes, and must not be below its bound.
TEST(CostMatrix, AgreesWithTheSearchOnPoints) {
  std::mt19937_64 random(4);
  laws::OwnedProblem p;
  p.points = inputs::cube(200, random);
  laws::add_weights(p, random);
  const double unit = laws::full_diagonal(p);
  for (const double price : {std::numeric_limits<double>::infinity(), 0.1}) {
    p.outlier_price = price;
    const FacilityPoints problem = p.view();
    const FacilityEntities entities{.count = p.points.size(),
                                    .distance =
                                        [&](std::uint32_t f, std::uint32_t c) {
                                          return distance(Euclidean{}, p.points[f], p.points[c]);
                                        },
                                    .weights = p.weights,
                                    .facility_cost = p.facility_cost * unit,
                                    .outlier_price = price * unit};
    for (const FacilityStrategy strategy :
         {FacilityStrategy::interchange, FacilityStrategy::jain_vazirani,
          FacilityStrategy::greedy_stars}) {
      SCOPED_TRACE(std::string(name_of(strategy)) + " at " + std::to_string(price));
      FacilityReport report;
      const FacilityOptions options{.strategy = strategy, .effort = Effort::fast};
      const FacilitySolution solution = solve(problem, options, &report);
      EXPECT_EQ(report.strategy, strategy);
      laws::expect_solution(p, solution);
      EXPECT_LE(solution.lower_bound, solution.cost());
      const auto search = make_search(problem);
      search->start(solution);
      search->assign_nearest();
      EXPECT_NEAR(search->cost(), solution.cost(), 1e-9 * solution.cost());
      const FacilitySolution same = solve(entities, options);
      EXPECT_EQ(same.facilities, solution.facilities);
      EXPECT_EQ(same.assignment, solution.assignment);
      EXPECT_NEAR(same.cost(), solution.cost(), 1e-12 * solution.cost());
      EXPECT_NEAR(same.lower_bound, solution.lower_bound, 1e-9 * solution.cost());
    }
  }
}

TEST(CostMatrix, RejectsStrategiesOfOtherProblems) {
  const std::vector<double> one{1.0};
  const FacilityMatrix matrix{1, 1, one, one};
  for (const FacilityStrategy strategy :
       {FacilityStrategy::full_scan, FacilityStrategy::kd_tree, FacilityStrategy::fast}) {
    EXPECT_THROW((void)solve(matrix, {.strategy = strategy}), std::invalid_argument);
  }
  const FacilitySolution start = solve(matrix);
  EXPECT_THROW((void)solve(matrix, {.start = &start}), std::invalid_argument);
}

TEST(CostMatrix, ReportsTheMemoryItNeeds) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = inputs::cube(1000, random);
  try {
    (void)solve(FacilityPoints{.points = points},
                {.strategy = FacilityStrategy::greedy_stars, .memory_limit = 1000000});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("8 MiB"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace terrace::cluster
