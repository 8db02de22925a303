// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include <terrace/cluster/linkage.hpp>

#include "tables/cluster_methods.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::Point3;

namespace {

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

}  // namespace

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

}  // namespace terrace::tools
