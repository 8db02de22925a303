// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "block/linear_block.hpp"
#include "facility/matrix/strategies.hpp"
#include "facility/points/make_search.hpp"
#include "facility/points/search_frame.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

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
