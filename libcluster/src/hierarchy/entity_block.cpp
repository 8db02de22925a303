// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/entity_block.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "block/linear_block.hpp"
#include "facility/corner_distance.hpp"
#include "ground.hpp"
#include "scaling.hpp"

namespace terrace::cluster {

void EntityBlockClusterer::run(std::span<const Point3> corners, std::size_t count, bool ordered,
                               std::span<const double> weights, double facility_cost,
                               const FacilityOptions& options, BlockClustering& result) {
  assert(count > 1 && corners.size() % count == 0);
  const Scaling scaling(corners);
  scaled_.resize(corners.size());
  std::transform(corners.begin(), corners.end(), scaled_.begin(),
                 [&](const Point3& p) { return scaling.scaled(p); });

  FacilityEntities problem;
  problem.count = corners.size() / count;
  problem.distance = [this, count, ordered](std::uint32_t facility, std::uint32_t client) {
    const Point3* const a = scaled_.data() + facility * count;
    const Point3* const b = scaled_.data() + client * count;
    return corner_distance(count, ordered, [a, b](std::size_t i, std::size_t j) {
      return squared_length(difference(a[i], b[j]));
    });
  };
  problem.symmetric = problem.triangle_inequality = true;
  problem.weights = weights;
  // If all entities are equal any cost works, but it must be positive.
  problem.facility_cost =
      std::clamp(facility_cost * scaling.diagonal, std::numeric_limits<double>::min(), 0x1p1000);
  FacilityOptions search = options;
  search.assign_nearest = true;
  if (options.strategy == FacilityStrategy::automatic && problem.count < kFullSearchBelow) {
    search.effort = std::max(options.effort, Effort::fine);
  }
  FacilitySolution solution = solve(problem, search);
  result.facilities = std::move(solution.facilities);
  result.assignment = std::move(solution.assignment);
  result.facility_cost = result.connection_cost = 0.0;
}

}  // namespace terrace::cluster
