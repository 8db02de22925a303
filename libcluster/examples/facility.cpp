// SPDX-License-Identifier: Apache-2.0
// Finds which of three depots to open for six shops, and how far the answer may be from the
// optimum.
#include <cstdio>

#include <terrace/cluster/facility_location.hpp>

int main() {
  using namespace terrace::cluster;
  const std::vector<double> opening{40, 55, 35};
  const std::vector<double> connection{
      5,  9,  12, 30, 28, 40,  // from the first depot to each shop
      14, 11, 8,  9,  12, 25,  // from the second
      33, 29, 31, 14, 6,  4,   // from the third
  };
  const FacilityMatrix problem{
      .facilities = 3, .clients = 6, .opening = opening, .connection = connection};
  FacilitySolution solution = solve(problem);
  solution.lower_bound = lower_bound(problem, solution).lower_bound;
  for (std::size_t i = 0; i < solution.assignment.size(); ++i) {
    std::printf("shop %zu from depot %u\n", i, solution.facilities[solution.assignment[i]]);
  }
  std::printf("cost %g, at most %.3f %% above the optimum\n", solution.cost(),
              100 * solution.gap());
  return solution.gap() < 1e-9 ? 0 : 1;
}
