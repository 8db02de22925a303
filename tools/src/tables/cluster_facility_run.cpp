// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <utility>

#include <terrace/cluster/facility_location.hpp>

#include "base/units.hpp"
#include "cli/clustering_options.hpp"
#include "tables/cluster_methods.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::FacilitySolution;
using cluster::FacilityStrategy;

namespace {

/// Steps towards the lower bound: as many as were asked for, else what takes seconds, as a step
/// looks at some clusters' worth of points around each point.
std::uint32_t bound_steps(const ClusterRequest& request, double points, double clusters) {
  if (request.bound_iterations) return *request.bound_iterations;
  const double distances = 4.0 * points * points / clusters;
  return static_cast<std::uint32_t>(std::clamp(3e9 / distances, 15.0, 300.0));
}

double bound_of(const ClusterRequest& request, const FacilityPoints& problem,
                const FacilitySolution& solution, const ClusterProgress& progress) {
  const std::uint32_t steps = bound_steps(request, static_cast<double>(problem.points.size()),
                                          static_cast<double>(solution.facilities.size()));
  if (steps == 0) return 0.0;
  cluster::LowerBoundOptions options;
  options.steps = steps;
  options.threads = request.threads;
  options.progress = [&](std::size_t done, std::size_t total) {
    progress(static_cast<double>(done) / static_cast<double>(total));
    return true;
  };
  return cluster::lower_bound(problem, solution, options).lower_bound;
}

}  // namespace

ClusterOutcome cluster_by_facilities(const ClusterRequest& request, const FacilityPoints& problem,
                                     const ClusterProgress& progress) {
  cluster::FacilityOptions options;
  options.strategy = strategy_of(request.strategy);
  // In this command `fast` means as much as `default`: on one block it would save milliseconds.
  options.effort = std::max(request.effort, cluster::Effort::standard);
  if (request.iterations == "tenth") {
    options.effort = cluster::Effort::standard;
  } else if (request.iterations == "log10") {
    options.effort = cluster::Effort::fine;
  } else if (request.iterations == "log2") {
    options.effort = cluster::Effort::full;
  } else if (!request.iterations.empty()) {
    options.steps = parse_count(request.iterations);
  }
  options.seed = request.seed;
  options.threads = request.threads;
  options.batch = request.batch;
  options.assign_nearest = true;
  options.progress = [&](std::size_t done, std::size_t total) {
    progress(static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(total, 1)));
    return true;
  };
  // The production path, unless something asks for what it does not do.
  constexpr std::size_t kFastPoints = std::size_t{1} << 24;
  if (request.strategy == "automatic" && request.iterations.empty() && request.batch == 1 &&
      problem.channels.size() == 0 && std::isinf(problem.outlier_price) &&
      problem.points.size() < kFastPoints && mapped(problem)) {
    options.strategy = FacilityStrategy::fast;
  }
  FacilitySolution solution = cluster::solve(problem, options);
  progress(1.0);
  solution.lower_bound = bound_of(request, problem, solution, progress);
  ClusterOutcome outcome;
  take(outcome, std::move(solution));
  return outcome;
}

ClusterOutcome cluster_by_growth(const ClusterRequest& request, const FacilityPoints& problem,
                                 const ClusterProgress& progress) {
  // Beside the matrix the growth keeps the clients sorted by facility, half as much again.
  FacilitySolution solution = cluster::solve(
      problem,
      {.strategy = FacilityStrategy::greedy_stars, .memory_limit = request.memory_bytes / 3 * 2});
  solution.lower_bound =
      std::max(solution.lower_bound, bound_of(request, problem, solution, progress));
  ClusterOutcome outcome;
  take(outcome, std::move(solution));
  return outcome;
}

}  // namespace terrace::tools
