// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/facility_location.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "block/linear_block.hpp"
#include "facility/matrix/strategies.hpp"
#include "facility/points/local_search.hpp"
#include "facility/points/search_frame.hpp"
#include "terrace/cluster/block.hpp"

namespace terrace::cluster {
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

bool is_cost(double value) { return value >= 0.0 && std::isfinite(value); }

void check_count(std::size_t count, const char* what) {
  constexpr std::size_t kMost = 0xfffffffe;
  if (count == 0) fail(std::string("facility location needs ") + what);
  if (count > kMost) {
    fail(std::to_string(count) + " " + what + ": at most " + std::to_string(kMost) +
         " are possible; cluster them in blocks (hierarchy.hpp)");
  }
}

void check_weights(std::span<const double> weights, std::size_t count, const std::string& one,
                   const std::string& many) {
  if (!weights.empty() && weights.size() != count) {
    fail(std::to_string(weights.size()) + " weights for " + std::to_string(count) + " " + many);
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] > 0.0 && std::isfinite(weights[i])) continue;
    fail("the weight of " + one + " " + std::to_string(i) + " is " + std::to_string(weights[i]) +
         ": weights must be positive and finite");
  }
}

[[noreturn]] void refuse(FacilityStrategy strategy, const std::string& why,
                         const std::string& remedy = "use automatic") {
  throw std::invalid_argument(std::string("the strategy \"") + name_of(strategy) + "\" " + why +
                              ": " + remedy);
}

bool needs_matrix(FacilityStrategy strategy) { return strategy >= FacilityStrategy::interchange; }

// Requires: check(problem) has passed.
FacilitySolution solve_matrix(const FacilityMatrix& problem, const FacilityOptions& options,
                              FacilityReport& report) {
  report.strategy = options.strategy == FacilityStrategy::automatic ? FacilityStrategy::interchange
                                                                    : options.strategy;
  if (!needs_matrix(report.strategy)) {
    refuse(report.strategy, "needs points or entities, but the problem is a matrix");
  }
  if (options.start) refuse(report.strategy, "does not start from a solution");
  switch (report.strategy) {
    case FacilityStrategy::jain_vazirani:
      return jain_vazirani(problem, report, options.check_stop);
    case FacilityStrategy::greedy_stars:
      return greedy_stars(problem, report, options.check_stop);
    default:
      return interchange(problem, options);
  }
}

template <class Problem>
FacilitySolution solve_by_matrix(const Problem& problem, const FacilityOptions& options,
                                 FacilityReport& report) {
  const CostMatrix matrix = cost_matrix(problem, options.memory_limit, options.check_stop);
  FacilitySolution solution = solve_matrix(matrix.view(), options, report);
  if (std::isfinite(problem.outlier_price)) {
    // In the matrix, an outlier is a client whose connection costs the price.
    const double lower_bound = solution.lower_bound;
    const auto engine = make_search(problem, FacilityStrategy::full_scan, 1, options.check_stop);
    engine->start(solution);
    solution = engine->solution();
    solution.lower_bound = lower_bound;
  }
  return solution;
}

FacilitySolution solve_fast(const FacilityPoints& problem, const FacilityOptions& options,
                            FacilityReport* report) {
  constexpr FacilityStrategy kFast = FacilityStrategy::fast;
  if (problem.points.size() >= (std::size_t{1} << 24)) {
    refuse(kFast, "accepts fewer than 2^24 points", "cluster them in blocks (hierarchy.hpp)");
  }
  if (!linear_map(problem.metric, base::box_of(problem.points))) {
    refuse(kFast, "needs a metric that a linear map of the points makes Euclidean, and \"" +
                      name_of(problem.metric) + "\" is not one on these points");
  }
  if (problem.channels.size() > 0) refuse(kFast, "does not support channels");
  if (std::isfinite(problem.outlier_price)) refuse(kFast, "cannot leave clients out");
  if (options.start) refuse(kFast, "does not start from a solution");

  BlockClusterer clusterer;
  BlockClustering clustering;
  run_linear(clusterer, problem,
             {.effort = options.effort, .seed = options.seed, .check_stop = options.check_stop},
             clustering);
  FacilitySolution solution;
  solution.facilities = std::move(clustering.facilities);
  solution.assignment = std::move(clustering.assignment);
  // Computes costs in double precision and clusters by ascending facility.
  const auto engine = make_search(problem, FacilityStrategy::full_scan, 1, options.check_stop);
  engine->start(solution);
  if (report) {
    report->strategy = kFast;
    report->search.wrongly_assigned = engine->wrongly_assigned();
  }
  if (options.assign_nearest) engine->assign_nearest();
  return engine->solution();
}

/// Solves by a matrix of costs or a local search.
template <class Problem>
FacilitySolution solve_any(const Problem& problem, const FacilityOptions& options,
                           FacilityReport* report) {
  check(problem);
  FacilityReport own;
  if (report) *report = {};
  if (needs_matrix(options.strategy)) {
    return solve_by_matrix(problem, options, report ? *report : own);
  }
  const auto engine = make_search(problem, options.strategy, options.threads, options.check_stop);
  return run_search(*engine, options, report);
}

}  // namespace

void check(const FacilityMatrix& problem, const base::StopCheck& check_stop) {
  check_count(problem.facilities, "facilities");
  check_count(problem.clients, "clients");
  if (problem.opening.size() != problem.facilities) {
    fail(std::to_string(problem.opening.size()) + " opening costs for " +
         std::to_string(problem.facilities) + " facilities");
  }
  if (problem.connection.size() / problem.facilities != problem.clients ||
      problem.connection.size() % problem.facilities != 0) {
    fail(std::to_string(problem.connection.size()) + " connection costs for " +
         std::to_string(problem.facilities) + " facilities times " +
         std::to_string(problem.clients) + " clients");
  }
  for (std::size_t j = 0; j < problem.facilities; ++j) {
    if (is_cost(problem.opening[j])) continue;
    fail("the opening cost of facility " + std::to_string(j) + " is " +
         std::to_string(problem.opening[j]) + ": costs must be finite and not negative");
  }
  base::StopTicks ticks(check_stop);
  for (std::size_t j = 0; j < problem.facilities; ++j) {
    ticks(problem.clients);
    for (std::size_t i = 0; i < problem.clients; ++i) {
      if (is_cost(problem.cost(j, i))) continue;
      fail("the cost of connecting client " + std::to_string(i) + " to facility " +
           std::to_string(j) + " is " + std::to_string(problem.cost(j, i)) +
           ": costs must be finite and not negative; for an impossible connection give a "
           "cost above every other");
    }
  }
}

void check(const FacilityPoints& problem) {
  const std::size_t count = problem.points.size();
  check_count(count, "points");
  check(problem.metric);
  for (std::size_t i = 0; i < count; ++i) {
    for (const double value : problem.points[i]) {
      if (!std::isfinite(value)) {
        fail("point " + std::to_string(i) + " has a coordinate that is not finite: leave it out");
      }
    }
  }
  check_weights(problem.weights, count, "point", "points");
  const std::size_t channels = problem.channels.size();
  for (std::size_t c = 0; c < channels; ++c) {
    if (is_cost(problem.channels.weights[c])) continue;
    fail("the weight of channel " + std::to_string(c) + " is " +
         std::to_string(problem.channels.weights[c]) + ": it must be finite and not negative");
  }
  if (problem.channels.values.size() != count * channels) {
    fail(std::to_string(problem.channels.values.size()) + " channel values for " +
         std::to_string(count) + " points with " + std::to_string(channels) + " channels");
  }
  for (std::size_t k = 0; k < problem.channels.values.size(); ++k) {
    if (std::isfinite(problem.channels.values[k])) continue;
    fail("channel " + std::to_string(k % channels) + " of point " + std::to_string(k / channels) +
         " is not finite: leave the point out or give it a value");
  }
  if (!(problem.facility_cost > 0.0) || !std::isfinite(problem.facility_cost)) {
    fail("the facility cost is " + std::to_string(problem.facility_cost) +
         " diagonals: it must be positive and finite");
  }
  if (!(problem.outlier_price > 0.0)) {
    fail("the price of an outlier is " + std::to_string(problem.outlier_price) +
         " diagonals: it must be positive (infinite: no outliers)");
  }
}

void check(const FacilityEntities& problem) {
  check_count(problem.count, "entities");
  if (!problem.distance) fail("the entities have no distance function");
  check_weights(problem.weights, problem.count, "entity", "entities");
  if (!(problem.facility_cost > 0.0) || !std::isfinite(problem.facility_cost)) {
    fail("the facility cost is " + std::to_string(problem.facility_cost) +
         ": it must be positive and finite, in the unit of the distances");
  }
  if (!(problem.outlier_price > 0.0)) {
    fail("the price of an outlier is " + std::to_string(problem.outlier_price) +
         ": it must be positive, in the unit of the distances (infinite: no outliers)");
  }
}

const char* name_of(FacilityStrategy strategy) {
  switch (strategy) {
    case FacilityStrategy::automatic:
      return "automatic";
    case FacilityStrategy::full_scan:
      return "full scan";
    case FacilityStrategy::quadtree:
      return "quadtree";
    case FacilityStrategy::octree:
      return "octree";
    case FacilityStrategy::kd_tree:
      return "kd-tree";
    case FacilityStrategy::facilities:
      return "facilities";
    case FacilityStrategy::fast:
      return "fast";
    case FacilityStrategy::interchange:
      return "interchange";
    case FacilityStrategy::jain_vazirani:
      return "Jain-Vazirani";
    case FacilityStrategy::greedy_stars:
      break;
  }
  return "greedy stars";
}

FacilitySolution solve(const FacilityPoints& problem, const FacilityOptions& options,
                       FacilityReport* report) {
  if (options.strategy != FacilityStrategy::fast) return solve_any(problem, options, report);
  check(problem);
  if (report) *report = {};
  return solve_fast(problem, options, report);
}

FacilitySolution solve(const FacilityEntities& problem, const FacilityOptions& options,
                       FacilityReport* report) {
  return solve_any(problem, options, report);
}

FacilitySolution solve(const FacilityMatrix& problem, const FacilityOptions& options,
                       FacilityReport* report) {
  check(problem, options.check_stop);
  FacilityReport own;
  if (report) *report = {};
  return solve_matrix(problem, options, report ? *report : own);
}

}  // namespace terrace::cluster
