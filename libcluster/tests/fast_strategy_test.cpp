// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clustering_laws.hpp"
#include "inputs.hpp"
#include "search_laws.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;
using laws::OwnedProblem;

std::vector<Metric> linear_metrics() {
  const double s = std::sqrt(0.5);
  return {Euclidean{}, Elliptical(2.0, 0.25, 30.0),
          Elliptical({300.0, 0.5, 2.0}, {s, s, 0, -s, s, 0, 0, 0, 1}),
          Elliptical(1e-200, 1e-201, 45.0, 1e-200),
          EllipticalField({{{{-kInfinity, -kInfinity, -kInfinity}, {1e300, 1e300, 1e300}},
                            Elliptical(4.0, 0.5, 70.0)}})};
}

TEST(FastStrategy, IsAsGoodAsTheSearchUnderLinearMetrics) {
  std::mt19937_64 random(14);
  for (const Metric& metric : linear_metrics()) {
    for (const bool weighted : {false, true}) {
      SCOPED_TRACE(name_of(metric) + (weighted ? ", weights" : ""));
      OwnedProblem p;
      p.points = inputs::cube(3000, random);
      p.metric = metric;
      p.facility_cost = 0.7;
      if (weighted) laws::add_weights(p, random);
      FacilityReport report;
      const FacilitySolution fast = solve(p.view(), {.strategy = FacilityStrategy::fast}, &report);
      ASSERT_NO_FATAL_FAILURE(laws::expect_solution(p, fast, 1e-8));
      const FacilitySolution search = solve(p.view());
      EXPECT_LT(fast.cost(), search.cost());
      // Single precision breaks ties differently from double.
      EXPECT_LE(report.search.wrongly_assigned, 3u);
      const FacilitySolution full =
          solve(p.view(), {.strategy = FacilityStrategy::fast, .effort = Effort::full});
      EXPECT_LT(full.cost(), fast.cost());
    }
  }
}

TEST(FastStrategy, EqualsTheBlockClustererUnderTheEuclideanMetric) {
  std::mt19937_64 random(15);
  OwnedProblem p;
  p.points = inputs::scan(2, 60, random);
  p.facility_cost = 1.0;
  const FacilitySolution fast = solve(p.view(), {.strategy = FacilityStrategy::fast});
  BlockClusterer clusterer;
  BlockClustering clustering;
  clusterer.run(p.points, {}, {}, clustering);
  EXPECT_NEAR(fast.cost(), clustering.cost(), 1e-3 * fast.cost());
  EXPECT_NEAR(static_cast<double>(fast.facilities.size()),
              static_cast<double>(clustering.facilities.size()), 3.0);
}

TEST(FastStrategy, HandlesDegenerateInput) {
  for (const Metric& metric : linear_metrics()) {
    for (OwnedProblem& p : laws::problems(90, 3)) {
      p.metric = metric;
      SCOPED_TRACE(name_of(metric) + ", " + p.name);
      const FacilitySolution solution = solve(p.view(), {.strategy = FacilityStrategy::fast});
      laws::expect_solution(p, solution, 1e-8);
    }
  }
}

TEST(FastStrategy, RejectsUnsupportedProblems) {
  std::mt19937_64 random(16);
  OwnedProblem p;
  p.points = inputs::cube(30, random);
  const auto message = [](const OwnedProblem& problem) -> std::string {
    try {
      (void)solve(problem.view(), {.strategy = FacilityStrategy::fast});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message(p), "");
  OwnedProblem bad = p;
  bad.metric = Minkowski{1.0};
  EXPECT_NE(message(bad).find("minkowski:1"), std::string::npos);
  bad.metric = EllipticalField({{{{0, 0, 0}, {0.5, 0.5, 0.5}}, Elliptical(2, 1, 0)}});
  EXPECT_NE(message(bad).find("elliptical field"), std::string::npos);
  bad = p;
  laws::add_channels(bad, random);
  EXPECT_NE(message(bad).find("channels"), std::string::npos);
  bad = p;
  bad.outlier_price = 1.0;
  EXPECT_NE(message(bad), "");
}

}  // namespace
}  // namespace terrace::cluster
