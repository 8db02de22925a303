// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <terrace/cluster/facility_location.hpp>

#include "tables/cluster_run.hpp"

/// What run_clustering() chooses from, and what the methods share.

namespace terrace::tools {

ClusterOutcome cluster_by_facilities(const ClusterRequest& request,
                                     const cluster::FacilityPoints& problem,
                                     const ClusterProgress& progress);
/// The primal-dual method.
ClusterOutcome cluster_by_growth(const ClusterRequest& request,
                                 const cluster::FacilityPoints& problem,
                                 const ClusterProgress& progress);
ClusterOutcome cluster_by_k_means(const ClusterRequest& request,
                                  const cluster::FacilityPoints& problem);
ClusterOutcome cluster_by_k_median(const ClusterRequest& request,
                                   const cluster::FacilityPoints& problem);
/// Single and complete linkage.
ClusterOutcome cluster_by_linkage(const ClusterRequest& request,
                                  const cluster::FacilityPoints& problem);

/// Costs, facilities and assignment of a solution.
void take(ClusterOutcome& outcome, cluster::FacilitySolution&& solution);

/// The points as a linear metric sees them; nothing if the metric is not linear on them.
std::optional<std::vector<cluster::Point3>> mapped(const cluster::FacilityPoints& problem);

/// For clusters that have no point of their own: the one nearest to the mean; the first of equals.
std::vector<std::uint32_t> nearest_to_means(std::span<const cluster::Point3> points,
                                            std::span<const std::uint32_t> labels,
                                            std::size_t clusters);

/// Throws: UsageError if there are channels, which the method does not understand.
void no_channels(const cluster::FacilityPoints& problem, const char* method);

}  // namespace terrace::tools
