// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "terrace/cluster/hierarchy.hpp"

/// The summaries of clusters. Private to the hierarchy.

namespace terrace::cluster {

/// Summary of a cluster of level 0: members are point numbers, including `representative`.
Summary summarise_points(std::span<const Point3> positions, std::span<const std::uint32_t> members,
                         std::uint32_t representative, const GroundMap& map);

/// The same above level 0: heads[i] is the summary of the cluster one level below headed by point
/// i.
Summary summarise_heads(std::span<const Point3> positions, std::span<const Summary> heads,
                        std::span<const std::uint32_t> members, std::uint32_t representative,
                        const GroundMap& map);

}  // namespace terrace::cluster
