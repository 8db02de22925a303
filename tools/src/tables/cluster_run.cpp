// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_run.hpp"

#include <array>
#include <utility>

#include "tables/cluster_methods.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr std::array<std::pair<const char*, ClusterMethod>, 6> kClusterMethods{
    {{"facility", ClusterMethod::facility},
     {"primal-dual", ClusterMethod::primal_dual},
     {"k-means", ClusterMethod::k_means},
     {"k-median", ClusterMethod::k_median},
     {"single", ClusterMethod::single},
     {"complete", ClusterMethod::complete}}};

}  // namespace

std::optional<ClusterMethod> cluster_method_of(const std::string& name) {
  for (const auto& [text, method] : kClusterMethods) {
    if (name == text) return method;
  }
  return std::nullopt;
}

ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress) {
  // Here, so that the message names the point whatever the method.
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
