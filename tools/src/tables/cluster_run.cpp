// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>
#include <terrace/cluster/linkage.hpp>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::FacilitySolution;
using cluster::FacilityStrategy;
using cluster::Point3;

namespace {

/// Costs, facilities and assignment of a solution.
void take(ClusterOutcome& outcome, FacilitySolution&& solution) {
  outcome.opening_cost = solution.opening_cost;
  outcome.connection_cost = solution.connection_cost;
  outcome.outlier_cost = solution.outlier_cost;
  if (solution.lower_bound > 0.0) outcome.lower_bound = solution.lower_bound;
  outcome.representatives = std::move(solution.facilities);
  outcome.labels = std::move(solution.assignment);
}

/// The points as a linear metric sees them; nullopt if the metric is not linear on them.
std::optional<std::vector<Point3>> mapped(const FacilityPoints& problem) {
  cluster::LinearMap m = cluster::kIdentityMap;
  if (const auto* elliptical = std::get_if<cluster::Elliptical>(&problem.metric)) {
    m = elliptical->map();
  } else if (const auto* field = std::get_if<cluster::EllipticalField>(&problem.metric)) {
    const auto uniform = field->uniform_in(cluster::bounds_of(problem.points));
    if (!uniform) return std::nullopt;
    m = *uniform;
  } else if (!std::holds_alternative<cluster::Euclidean>(problem.metric)) {
    return std::nullopt;
  }
  std::vector<Point3> points(problem.points.begin(), problem.points.end());
  if (m == cluster::kIdentityMap) return points;
  for (Point3& p : points) {
    p = {m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[3] * p[0] + m[4] * p[1] + m[5] * p[2],
         m[6] * p[0] + m[7] * p[1] + m[8] * p[2]};
  }
  return points;
}

/// For clusters that have no point of their own: the one nearest to the mean; the first of equals.
std::vector<std::uint32_t> nearest_to_means(std::span<const Point3> points,
                                            std::span<const std::uint32_t> labels,
                                            std::size_t clusters) {
  std::vector<Point3> mean(clusters, Point3{});
  std::vector<double> count(clusters, 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) mean[labels[i]][axis] += points[i][axis];
    count[labels[i]] += 1.0;
  }
  for (std::size_t c = 0; c < clusters; ++c) {
    for (double& v : mean[c]) v /= std::max(count[c], 1.0);
  }
  std::vector<std::uint32_t> representative(clusters, 0);
  std::vector<double> least(clusters, std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::uint32_t c = labels[i];
    const double d = cluster::distance(cluster::Euclidean{}, mean[c], points[i]);
    if (d < least[c]) {
      least[c] = d;
      representative[c] = i;
    }
  }
  return representative;
}

void no_channels(const FacilityPoints& problem, const char* method) {
  if (problem.channels.size() > 0) {
    throw UsageError(std::string("--channel is for the methods facility, primal-dual and k-median, "
                                 "not for ") +
                     method);
  }
}

/// Steps towards the lower bound: as many as requested, else some seconds' worth, as a step looks
/// at a few clusters' worth of points around each point.
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

ClusterOutcome cluster_by_facilities(const ClusterRequest& request, const FacilityPoints& problem,
                                     const ClusterProgress& progress) {
  cluster::FacilityOptions options;
  options.strategy = request.strategy;
  // In this command `fast` equals `default`: on one block it would save milliseconds.
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
  // The production path, unless an option asks for what it cannot do.
  constexpr std::size_t kFastPoints = std::size_t{1} << 24;
  if (request.strategy == FacilityStrategy::automatic && request.iterations.empty() &&
      request.batch == 1 && problem.channels.size() == 0 && std::isinf(problem.outlier_price) &&
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

/// The primal-dual method.
ClusterOutcome cluster_by_growth(const ClusterRequest& request, const FacilityPoints& problem,
                                 const ClusterProgress& progress) {
  // Besides the matrix, the growth keeps the clients sorted by facility: half as much again.
  FacilitySolution solution = cluster::solve(
      problem,
      {.strategy = FacilityStrategy::greedy_stars, .memory_limit = request.memory_bytes / 3 * 2});
  solution.lower_bound =
      std::max(solution.lower_bound, bound_of(request, problem, solution, progress));
  ClusterOutcome outcome;
  take(outcome, std::move(solution));
  return outcome;
}

ClusterOutcome cluster_by_k_means(const ClusterRequest& request, const FacilityPoints& problem) {
  no_channels(problem, "k-means");
  std::vector<Point3> points;
  if (std::holds_alternative<cluster::SquaredEuclidean>(problem.metric)) {
    points.assign(problem.points.begin(), problem.points.end());
  } else if (auto linear = mapped(problem)) {
    points = std::move(*linear);
  } else {
    throw UsageError(
        "--method k-means sums squares: it takes --metric euclidean, squared, or "
        "elliptical with one region for all points");
  }
  const cluster::KMeansResult result = cluster::k_means(points, problem.weights,
                                                        {.clusters = request.k,
                                                         .seed = request.seed,
                                                         .restarts = request.restarts,
                                                         .threads = request.threads});
  ClusterOutcome outcome;
  outcome.connection_cost = result.sse;
  outcome.labels = result.assignment;
  // Clusters that stayed empty, for lack of distinct points, do not count.
  std::vector<std::uint32_t> number(request.k, cluster::kOutlier);
  std::uint32_t used = 0;
  for (std::uint32_t& label : outcome.labels) {
    if (number[label] == cluster::kOutlier) number[label] = used++;
    label = number[label];
  }
  if (used < request.k) {
    outcome.notes.push_back("there are only " + std::to_string(used) +
                            " distinct points: as many clusters");
  }
  if (!result.converged) {
    outcome.notes.push_back("k-means stopped after " + std::to_string(result.iterations) +
                            " iterations, before it had come to rest");
  }
  outcome.representatives = nearest_to_means(points, outcome.labels, used);
  return outcome;
}

ClusterOutcome cluster_by_k_median(const ClusterRequest& request, const FacilityPoints& problem) {
  // Each step takes the distances of all pairs; fewer than a hundred steps give no useful bound.
  constexpr std::size_t kMostForBound = 10'000;
  const std::uint32_t steps =
      request.bound_iterations.value_or(problem.points.size() <= kMostForBound ? 100 : 0);
  ClusterOutcome outcome;
  take(outcome, cluster::k_median(problem, request.k,
                                  {.restarts = static_cast<std::uint32_t>(request.restarts),
                                   .bound_steps = steps,
                                   .seed = request.seed,
                                   .threads = request.threads}));
  outcome.opening_cost.reset();
  return outcome;
}

cluster::Dendrogram complete_tree(const ClusterRequest& request, const FacilityPoints& problem,
                                  const std::optional<std::vector<Point3>>& points) {
  cluster::LinkageOptions options;
  options.threads = request.threads;
  options.entry =
      request.single_precision ? cluster::MatrixEntry::float32 : cluster::MatrixEntry::float64;
  options.memory_limit = request.memory_bytes;
  if (points) return cluster::complete_linkage(*points, options);
  if (!cluster::is_symmetric(problem.metric)) {
    throw UsageError(
        "--method complete needs a symmetric metric: a field of ellipses is not symmetric "
        "(the points lie in several of its regions)");
  }
  return cluster::complete_linkage(
      problem.points.size(),
      [&](std::uint32_t i, std::uint32_t j) {
        return cluster::distance(problem.metric, problem.points[i], problem.points[j]);
      },
      options);
}

/// Single and complete linkage.
ClusterOutcome cluster_by_linkage(const ClusterRequest& request, const FacilityPoints& problem) {
  const bool single = request.method == ClusterMethod::single;
  no_channels(problem, single ? "single" : "complete");
  if (!problem.weights.empty())
    throw UsageError("--weight is not for linkage: it counts no points");
  const std::optional<std::vector<Point3>> points = mapped(problem);
  ClusterOutcome outcome;
  if (request.cuda) {
    if (!points) throw UsageError("--device cuda takes --metric euclidean or elliptical");
    outcome.dendrogram =
        single ? cluster::cuda_single_linkage(*points)
               : cluster::cuda_complete_linkage(*points, request.single_precision
                                                             ? cluster::MatrixEntry::float32
                                                             : cluster::MatrixEntry::float64);
  } else if (!single) {
    outcome.dendrogram = complete_tree(request, problem, points);
  } else if (points) {
    outcome.dendrogram = cluster::single_linkage(*points, {.threads = request.threads});
  } else {
    throw UsageError(
        "--method single goes through the Euclidean minimum spanning tree: it takes "
        "--metric euclidean, or elliptical with one region for all points");
  }
  if (request.k != 0) outcome.labels = cluster::cut_count(*outcome.dendrogram, request.k);
  if (request.height) outcome.labels = cluster::cut_height(*outcome.dendrogram, *request.height);
  if (outcome.labels.empty()) return outcome;
  const std::size_t clusters =
      std::size_t{*std::max_element(outcome.labels.begin(), outcome.labels.end())} + 1;
  if (request.k != 0 && clusters < request.k) {
    outcome.notes.push_back("merges of equal height leave no cut into " +
                            std::to_string(request.k) + " clusters: there are " +
                            std::to_string(clusters));
  }
  outcome.representatives = nearest_to_means(problem.points, outcome.labels, clusters);
  return outcome;
}

}  // namespace

ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress) {
  // Checked here, so that the message names the point for every method.
  cluster::check(problem);
  if (request.k > problem.points.size()) {
    throw UsageError("-k " + std::to_string(request.k) +
                     " asks for more clusters than there are "
                     "points (" +
                     std::to_string(problem.points.size()) + ")");
  }
  progress(0.0);
  switch (request.method) {
    case ClusterMethod::facility:
      return cluster_by_facilities(request, problem, progress);
    case ClusterMethod::primal_dual:
      return cluster_by_growth(request, problem, progress);
    case ClusterMethod::k_means:
      return cluster_by_k_means(request, problem);
    case ClusterMethod::k_median:
      return cluster_by_k_median(request, problem);
    case ClusterMethod::single:
    case ClusterMethod::complete:
      break;
  }
  return cluster_by_linkage(request, problem);
}

}  // namespace terrace::tools
