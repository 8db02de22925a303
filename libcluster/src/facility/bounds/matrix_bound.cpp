// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "facility/bounds/dual_ascent.hpp"
#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/strategies.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

// Returns the value at scaled duals, in the unit of the problem, rounded down.
double finished(const MatrixRows& costs, const std::vector<double>& duals) {
  RowDual function(costs, costs.opening(), {}, 1);
  std::vector<double> slope(duals.size());
  return costs.unscaled(std::max(0.0, function.evaluate(duals, slope).safe()));
}

void unscale(const MatrixRows& costs, std::vector<double>& duals) {
  for (double& v : duals) v = costs.unscaled(v);
}

std::vector<double> ascended(const MatrixRows& costs) {
  constexpr int kAdjustments = 20;
  const ClientOrder order(costs);
  DualAscent ascent(order, costs);
  std::vector<std::uint32_t> all(costs.clients());
  std::iota(all.begin(), all.end(), 0u);
  ascent.raise(all);
  for (int k = 0; k < kAdjustments; ++k) {
    if (!ascent.adjust()) break;
  }
  return ascent.duals();
}

}  // namespace

double dual_value(const FacilityMatrix& problem, std::span<const double> duals,
                  const base::StopCheck& check_stop) {
  check(problem, check_stop);
  if (duals.size() != problem.clients) {
    throw std::invalid_argument(std::to_string(duals.size()) + " duals for " +
                                std::to_string(problem.clients) + " clients");
  }
  for (std::size_t i = 0; i < duals.size(); ++i) {
    if (std::isfinite(duals[i])) continue;
    throw std::invalid_argument("the dual of client " + std::to_string(i) + " is not finite");
  }
  const MatrixRows costs(problem, check_stop);
  std::vector<double> scaled(duals.begin(), duals.end());
  for (double& v : scaled) v = costs.scaled(v);
  return finished(costs, scaled);
}

LowerBound lower_bound(const FacilityMatrix& problem, const FacilitySolution& start,
                       const LowerBoundOptions& options) {
  check(problem, options.check_stop);
  const MatrixRows costs(problem, options.check_stop);
  LowerBound bound;
  bound.duals = ascended(costs);
  if (options.steps > 0) {
    FacilityReport report;
    const FacilitySolution target =
        start.facilities.empty() ? greedy_stars(problem, report, options.check_stop) : start;
    double cost = 0.0;  // scaled, because the sum of large costs may be infinite
    for (const std::uint32_t j : target.facilities) {
      if (j >= problem.facilities) {
        throw std::invalid_argument("the solution has facility " + std::to_string(j) +
                                    ", but there are only " + std::to_string(problem.facilities));
      }
      cost += costs.opening()[j];
    }
    if (target.assignment.size() != problem.clients) {
      throw std::invalid_argument("the solution assigns " +
                                  std::to_string(target.assignment.size()) +
                                  " clients, but there are " + std::to_string(problem.clients));
    }
    for (std::size_t i = 0; i < problem.clients; ++i) {
      const std::uint32_t c = target.assignment[i];
      if (c >= target.facilities.size()) {
        throw std::invalid_argument("the solution leaves client " + std::to_string(i) +
                                    " without a facility");
      }
      cost += costs.cost(target.facilities[c], i);
    }
    RowDual function(costs, costs.opening(), {}, options.threads);
    function.clamp(bound.duals);
    ascend(function, bound.duals, cost, options);
  }
  bound.lower_bound = finished(costs, bound.duals);
  unscale(costs, bound.duals);
  return bound;
}

}  // namespace terrace::cluster
