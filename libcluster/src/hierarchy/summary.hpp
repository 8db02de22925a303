// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "terrace/cluster/hierarchy.hpp"

/// Computes the summaries of clusters. Private to the hierarchy.

namespace terrace::cluster {

/// Summarises a cluster of level 0. members: point numbers, including `representative`.
ClusterSummary summarise_points(std::span<const Point3> positions,
                                std::span<const std::uint32_t> members,
                                std::uint32_t representative, const GroundMap& map);

/// Summarises a cluster above level 0. heads[i] is the summary of the cluster one level below that
/// is headed by point i.
ClusterSummary summarise_heads(std::span<const Point3> positions,
                               std::span<const ClusterSummary> heads,
                               std::span<const std::uint32_t> members, std::uint32_t representative,
                               const GroundMap& map);

}  // namespace terrace::cluster
