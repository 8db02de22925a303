// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_median.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/median_search.hpp"
#include "facility/points/point_space.hpp"

namespace terrace::cluster {
namespace {

void check_count(std::size_t k, std::size_t facilities, const KMedianOptions& options) {
  if (k == 0) throw std::invalid_argument("k-median with k = 0: give at least 1");
  if (k > facilities) {
    throw std::invalid_argument("k-median with k = " + std::to_string(k) + ", but there are only " +
                                std::to_string(facilities) + " places: give at most that many");
  }
  if (options.restarts == 0) {
    throw std::invalid_argument("restarts is 0: give at least 1");
  }
}

struct Connections {
  std::vector<std::uint32_t> nearest;  // position in the list of facilities, the first on ties
  std::vector<double> cost;
  std::vector<double> second;
};

Connections connect(const CostRows& costs, std::span<const std::uint32_t> facilities) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::size_t n = costs.clients();
  Connections result{std::vector<std::uint32_t>(n, 0), std::vector<double>(n, kInfinity),
                     std::vector<double>(n, kInfinity)};
  std::vector<double> scratch;
  for (std::uint32_t k = 0; k < facilities.size(); ++k) {
    const double* const row = costs.row(facilities[k], scratch);
    for (std::size_t i = 0; i < n; ++i) {
      if (row[i] < result.cost[i]) {
        result.second[i] = result.cost[i];
        result.cost[i] = row[i];
        result.nearest[i] = k;
      } else {
        result.second[i] = std::min(result.second[i], row[i]);
      }
    }
  }
  return result;
}

// Starts the duals from what each client would pay for its second facility.
double bound(const CostRows& costs, const Connections& connections, std::size_t k,
             const KMedianOptions& options) {
  if (options.bound_steps == 0) return 0.0;
  double cost = 0.0;
  std::vector<double> duals(costs.clients());
  for (std::size_t i = 0; i < duals.size(); ++i) {
    cost += connections.cost[i];
    duals[i] = std::isfinite(connections.second[i]) ? connections.second[i] : connections.cost[i];
  }
  MedianDual function(costs, k, options.threads);
  return std::max(0.0, ascend(function, duals, cost, {.steps = options.bound_steps}));
}

}  // namespace

FacilitySolution k_median(const FacilityMatrix& problem, std::size_t k,
                          const KMedianOptions& options) {
  check(problem, options.check_stop);
  check_count(k, problem.facilities, options);
  const MatrixRows costs(problem, options.check_stop);
  FacilitySolution solution;
  solution.facilities = find_medians(costs, k, options);
  const Connections connections = connect(costs, solution.facilities);
  solution.assignment = connections.nearest;
  for (std::size_t i = 0; i < problem.clients; ++i) {
    solution.connection_cost += problem.cost(solution.facilities[solution.assignment[i]], i);
  }
  solution.lower_bound = costs.unscaled(bound(costs, connections, k, options));
  return solution;
}

FacilitySolution k_median(const FacilityPoints& problem, std::size_t k,
                          const KMedianOptions& options) {
  check(problem);
  check_count(k, problem.points.size(), options);
  SearchFrame frame = make_frame(problem);
  const double rounding = rounding_of_frame(problem, frame);
  return with_space(problem, frame, problem.points, [&](const auto& space) {
    const PointRows costs(space, frame.weights, frame.outlier_price, options.check_stop);
    FacilitySolution solution;
    solution.facilities = find_medians(costs, k, options);
    Connections connections = connect(costs, solution.facilities);
    solution.assignment = connections.nearest;
    for (std::uint32_t c = 0; c < k; ++c) solution.assignment[solution.facilities[c]] = c;
    for (std::uint32_t i = 0; i < problem.points.size(); ++i) {
      const double d = space.from(solution.facilities[solution.assignment[i]])(i);
      if (d > frame.outlier_price) {
        solution.assignment[i] = kOutlier;
        solution.outlier_cost += frame.weights[i] * frame.outlier_price;
      } else {
        solution.connection_cost += frame.weights[i] * d;
      }
    }
    const auto unscaled = [&](double cost) { return std::ldexp(cost, frame.cost_exponent); };
    solution.connection_cost = unscaled(solution.connection_cost);
    solution.outlier_cost = unscaled(solution.outlier_cost);
    solution.lower_bound =
        unscaled(std::max(0.0, bound(costs, connections, k, options) - rounding));
    return solution;
  });
}

}  // namespace terrace::cluster
