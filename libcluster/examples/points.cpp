// SPDX-License-Identifier: Apache-2.0
// Facility location of points under a metric of choice, with outliers and a bound on the optimum.
#include <algorithm>
#include <cstdio>
#include <vector>

#include <terrace/cluster/facility_location.hpp>

int main() {
  using namespace terrace::cluster;

  // Houses along the streets of two villages, and a lone farm far from both.
  std::vector<Point3> points;
  for (int house = 0; house < 40; ++house) {
    points.push_back({10.0 * house, house % 4 == 0 ? 15.0 : 0.0, 0.0});
    points.push_back({3000.0, 2000.0 + 10.0 * house, 0.0});
  }
  points.push_back({9000.0, 9000.0, 0.0});

  // Distances along streets, not as the crow flies.
  FacilityPoints problem{.points = points, .metric = Minkowski{1.0}, .facility_cost = 0.2};
  problem.outlier_price = 0.1;  // points farther than this from every facility are left out
  FacilitySolution solution = solve(problem, {.effort = Effort::fine});
  solution.lower_bound = lower_bound(problem, solution).lower_bound;

  const auto outliers =
      std::count(solution.assignment.begin(), solution.assignment.end(), kOutlier);
  std::printf("%zu facilities, %td outlier(s), cost %.0f, at most %.1f %% above the optimum\n",
              solution.facilities.size(), outliers, solution.cost(), 100.0 * solution.gap());
  return solution.facilities.size() == 2 && outliers == 1 && solution.gap() < 0.1 ? 0 : 1;
}
