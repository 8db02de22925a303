// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/point_matrix.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "terrace/cluster/point_search.hpp"
#include "terrace/cluster/primal_dual.hpp"

namespace terrace::cluster {
namespace {

TEST(PointMatrix, HoldsTheWeightedDistancesOfAllPairs) {
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
      const PointMatrix matrix =
          point_matrix({.points = scaled, .weights = weights, .metric = metric});
      ASSERT_EQ(matrix.connection.size(), points.size() * points.size());
      for (std::size_t j = 0; j < points.size(); ++j) {
        EXPECT_NEAR(matrix.opening[j] / diagonal(metric, bounds_of(scaled)), 1.0, 1e-12);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double expected = weights[i] * distance(metric, scaled[j], scaled[i]);
          EXPECT_NEAR(matrix.view().cost(j, i), expected, 1e-12 * expected);
        }
      }
    }
  }
  // Channels are one more axis.
  const PointMatrix matrix =
      point_matrix({.points = points, .channels = {values, channel_weights}});
  const double flat = distance(Euclidean{}, points[3], points[7]);
  EXPECT_NEAR(matrix.view().cost(3, 7), std::hypot(flat, 0.5 * (values[3] - values[7])), 1e-12);
}

// A solution of the matrix costs the same as the search on points reckons it.
TEST(PointMatrix, AgreesWithTheSearchOnPoints) {
  std::mt19937_64 random(4);
  const std::vector<Point3> points = inputs::cube(200, random);
  for (const double price : {std::numeric_limits<double>::infinity(), 0.1}) {
    const FacilityPoints problem{.points = points, .facility_cost = 0.5, .outlier_price = price};
    const FacilitySolution solution = greedy_stars(point_matrix(problem).view()).solution;
    PointSearch search(problem);
    search.start(solution);
    search.assign_nearest();
    EXPECT_NEAR(search.cost(), solution.cost(), 1e-9 * solution.cost());
  }
}

TEST(PointMatrix, SaysHowMuchMemoryItWouldNeed) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = inputs::cube(1000, random);
  try {
    (void)point_matrix({.points = points}, 1000000);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("8 MiB"), std::string::npos) << error.what();
  }
  EXPECT_THROW((void)point_matrix({.points = {}}), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
