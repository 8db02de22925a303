// SPDX-License-Identifier: GPL-3.0-or-later
// The methods that are told the number of clusters: k-means and k-median.
#include <utility>
#include <variant>

#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>

#include "tables/cluster_methods.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::Point3;

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
  // Clusters that stayed empty, for want of distinct points, are no clusters.
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
  // Each step takes the distances of all pairs, and a hundred are the least that say something.
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

}  // namespace terrace::tools
