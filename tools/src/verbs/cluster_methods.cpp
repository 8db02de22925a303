// SPDX-License-Identifier: GPL-3.0-or-later
#include "verbs/cluster_methods.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include <fmt/core.h>
#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
using cluster::FacilityPoints;
using cluster::FacilitySolution;
using cluster::FacilityStrategy;
using cluster::Point3;

namespace {

/// Returns a facility solution as an outcome; its facilities are the representatives.
ClusterOutcome outcome_from(FacilitySolution&& solution) {
  ClusterOutcome outcome;
  outcome.opening_cost = solution.opening_cost;
  outcome.connection_cost = solution.connection_cost;
  outcome.outlier_cost = solution.outlier_cost;
  if (solution.lower_bound > 0.0) outcome.lower_bound = solution.lower_bound;
  outcome.representatives = std::move(solution.facilities);
  outcome.labels = std::move(solution.assignment);
  return outcome;
}

/// Throws UsageError if the problem has channels, which `method` does not support.
void refuse_channels(const FacilityPoints& problem, const char* method) {
  if (problem.channels.size() > 0) {
    throw UsageError(std::string("--channel is for the methods facility, primal-dual and k-median, "
                                 "not for ") +
                     method);
  }
}

/// Returns the number of steps of the lower bound that take a few seconds. Returns 0 if even the
/// fewest useful steps take much longer, because there are many points in few clusters: around each
/// point, a step examines about as many points as four clusters contain.
std::uint32_t default_bound_steps(std::size_t points, std::size_t clusters) {
  constexpr double kMinSteps = 15.0, kMaxSteps = 300.0;
  constexpr double kTargetDistances = 3e9, kMaxDistances = 6e9;
  const double distances_per_step = 4.0 * static_cast<double>(points) *
                                    static_cast<double>(points) / static_cast<double>(clusters);
  if (kMinSteps * distances_per_step > kMaxDistances) return 0;
  return static_cast<std::uint32_t>(
      std::clamp(kTargetDistances / distances_per_step, kMinSteps, kMaxSteps));
}

/// Returns the outcome of `solution` with a lower bound of the cost. If the bound would take too
/// long, a note in the outcome says so instead.
ClusterOutcome outcome_with_bound(const ClusterRequest& request, const FacilityPoints& problem,
                                  FacilitySolution&& solution, const ClusterProgress& progress) {
  const std::uint32_t steps = request.bound_iterations.value_or(
      default_bound_steps(problem.points.size(), solution.facilities.size()));
  if (steps > 0) {
    cluster::LowerBoundOptions options;
    options.steps = steps;
    options.threads = request.threads;
    options.progress = [&](std::size_t done, std::size_t total) {
      progress(static_cast<double>(done) / static_cast<double>(total));
      return true;
    };
    options.check_stop = check_interrupt;
    solution.lower_bound = std::max(solution.lower_bound,
                                    cluster::lower_bound(problem, solution, options).lower_bound);
  }
  ClusterOutcome outcome = outcome_from(std::move(solution));
  if (steps == 0 && !request.bound_iterations && !outcome.lower_bound) {
    outcome.notes.emplace_back(
        "no lower bound of the cost: with few clusters of many points it takes long; "
        "--bound-iterations 15 computes one");
  }
  return outcome;
}

ClusterOutcome cluster_by_facilities(const ClusterRequest& request, const FacilityPoints& problem,
                                     const ClusterProgress& progress) {
  cluster::FacilityOptions options;
  options.strategy = request.strategy;
  // Treat `fast` as `default`, because on one block it would only save milliseconds.
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
  options.check_stop = check_interrupt;
  // Prefer the production engine unless an option needs a feature that it lacks.
  constexpr std::size_t kMaxFastPoints = std::size_t{1} << 24;
  if (request.strategy == FacilityStrategy::automatic && request.iterations.empty() &&
      request.batch == 1 && problem.channels.size() == 0 && std::isinf(problem.outlier_price) &&
      problem.points.size() < kMaxFastPoints &&
      cluster::linear_map(problem.metric, base::box_of(problem.points))) {
    options.strategy = FacilityStrategy::fast;
  }
  FacilitySolution solution = cluster::solve(problem, options);
  progress(1.0);
  return outcome_with_bound(request, problem, std::move(solution), progress);
}

ClusterOutcome cluster_by_primal_dual(const ClusterRequest& request, const FacilityPoints& problem,
                                      const ClusterProgress& progress) {
  // Besides the matrix, the method keeps the clients sorted by facility, which takes half as much.
  FacilitySolution solution = cluster::solve(problem, {.strategy = FacilityStrategy::greedy_stars,
                                                       .memory_limit = request.memory_bytes / 3 * 2,
                                                       .check_stop = check_interrupt});
  return outcome_with_bound(request, problem, std::move(solution), progress);
}

ClusterOutcome cluster_by_k_means(const ClusterRequest& request, const FacilityPoints& problem) {
  refuse_channels(problem, "k-means");
  const bool squared = std::holds_alternative<cluster::SquaredEuclidean>(problem.metric);
  const auto linear =
      cluster::linear_points(squared ? cluster::Euclidean{} : problem.metric, problem.points);
  if (!linear) {
    throw UsageError(
        "--method k-means sums squares: it takes --metric euclidean, squared, or elliptical with "
        "one region for all points");
  }
  const std::vector<Point3>& points = *linear;
  const cluster::KMeansResult result = cluster::k_means(points, problem.weights,
                                                        {.clusters = request.k,
                                                         .seed = request.seed,
                                                         .restarts = request.restarts,
                                                         .threads = request.threads,
                                                         .check_stop = check_interrupt});
  ClusterOutcome outcome;
  outcome.connection_cost = result.sse;
  outcome.labels = result.assignment;
  // Renumber the clusters without those that stayed empty for lack of distinct points.
  std::vector<std::uint32_t> new_label(request.k, cluster::kOutlier);
  std::uint32_t nonempty = 0;
  for (std::uint32_t& label : outcome.labels) {
    if (new_label[label] == cluster::kOutlier) new_label[label] = nonempty++;
    label = new_label[label];
  }
  if (nonempty < request.k) {
    outcome.notes.push_back(fmt::format("{}{}, and therefore no more clusters",
                                        nonempty == 1 ? "there is only " : "there are only ",
                                        counted(nonempty, "distinct point")));
  }
  if (!result.converged) {
    outcome.notes.push_back("k-means stopped after " + counted(result.iterations, "iteration") +
                            ", before it converged");
  }
  outcome.representatives = cluster::nearest_to_means(points, outcome.labels, nonempty);
  return outcome;
}

ClusterOutcome cluster_by_k_median(const ClusterRequest& request, const FacilityPoints& problem) {
  // Each step computes the distances of all pairs, and fewer than 100 steps give no useful bound.
  constexpr std::size_t kMaxPointsForBound = 10'000;
  const std::uint32_t steps =
      request.bound_iterations.value_or(problem.points.size() <= kMaxPointsForBound ? 100 : 0);
  ClusterOutcome outcome =
      outcome_from(cluster::k_median(problem, request.k,
                                     {.restarts = static_cast<std::uint32_t>(request.restarts),
                                      .bound_steps = steps,
                                      .seed = request.seed,
                                      .threads = request.threads,
                                      .check_stop = check_interrupt}));
  outcome.opening_cost.reset();
  return outcome;
}

/// Returns the tree of all points, computed on the CPU. `points` are the positions if the metric is
/// linear. Throws UsageError if the linkage method does not support the metric.
cluster::Dendrogram linkage_on_cpu(const ClusterRequest& request, const FacilityPoints& problem,
                                   const std::optional<std::vector<Point3>>& points) {
  const std::string method = fmt::format("--method {}", request.linkage_name);
  cluster::LinkageOptions options;
  options.threads = request.threads;
  options.entry =
      request.single_precision ? cluster::MatrixEntry::float32 : cluster::MatrixEntry::float64;
  options.memory_limit = request.memory_bytes;
  options.check_stop = check_interrupt;
  if (points) return cluster::linkage(*points, request.linkage, options);
  switch (request.linkage) {
    case cluster::LinkageMethod::complete:
    case cluster::LinkageMethod::average:
    case cluster::LinkageMethod::weighted:
      break;
    case cluster::LinkageMethod::single:
      throw UsageError(method +
                       " uses the Euclidean minimum spanning tree: it takes --metric euclidean, or "
                       "elliptical with one region for all points");
    case cluster::LinkageMethod::ward:
    case cluster::LinkageMethod::centroid:
    case cluster::LinkageMethod::median:
      throw UsageError(method +
                       " measures distances of means: it takes --metric euclidean, or elliptical "
                       "with one region for all points");
  }
  if (!cluster::is_symmetric(problem.metric)) {
    throw UsageError(method +
                     " needs a symmetric metric: a field of ellipses is not symmetric (the points "
                     "are in several of its regions)");
  }
  return cluster::linkage(
      problem.points.size(),
      [&](std::uint32_t i, std::uint32_t j) {
        return cluster::distance(problem.metric, problem.points[i], problem.points[j]);
      },
      request.linkage, options);
}

ClusterOutcome cluster_by_linkage(const ClusterRequest& request, const FacilityPoints& problem) {
  refuse_channels(problem, request.linkage_name.c_str());
  if (!problem.weights.empty())
    throw UsageError("--weight does not apply to the methods of linkage");
  const std::optional<std::vector<Point3>> points =
      cluster::linear_points(problem.metric, problem.points);
  ClusterOutcome outcome;
  if (request.cuda) {
    if (!points) throw UsageError("--device cuda takes --metric euclidean or elliptical");
    outcome.dendrogram =
        request.linkage == cluster::LinkageMethod::single
            ? cluster::cuda_single_linkage(*points)
            : cluster::cuda_complete_linkage(*points, request.single_precision
                                                          ? cluster::MatrixEntry::float32
                                                          : cluster::MatrixEntry::float64);
  } else {
    outcome.dendrogram = linkage_on_cpu(request, problem, points);
  }
  if (request.k != 0) outcome.labels = cluster::cut_count(*outcome.dendrogram, request.k);
  if (request.height) outcome.labels = cluster::cut_height(*outcome.dendrogram, *request.height);
  if (outcome.labels.empty()) return outcome;
  const std::size_t clusters =
      std::size_t{*std::max_element(outcome.labels.begin(), outcome.labels.end())} + 1;
  if (request.k != 0 && clusters < request.k) {
    outcome.notes.push_back(fmt::format("merges of equal height leave no cut into {}: there are {}",
                                        counted(request.k, "cluster"), clusters));
  }
  outcome.representatives = cluster::nearest_to_means(problem.points, outcome.labels, clusters);
  return outcome;
}

}  // namespace

ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress) {
  // Check before any method starts, so that the message always names the point.
  cluster::check(problem);
  if (request.k > problem.points.size()) {
    throw UsageError(fmt::format("-k {} asks for more clusters than there are points ({})",
                                 request.k, problem.points.size()));
  }
  progress(0.0);
  switch (request.method) {
    case ClusterMethod::facility:
      return cluster_by_facilities(request, problem, progress);
    case ClusterMethod::primal_dual:
      return cluster_by_primal_dual(request, problem, progress);
    case ClusterMethod::k_means:
      return cluster_by_k_means(request, problem);
    case ClusterMethod::k_median:
      return cluster_by_k_median(request, problem);
    case ClusterMethod::linkage:
      break;
  }
  return cluster_by_linkage(request, problem);
}

}  // namespace terrace::tools
