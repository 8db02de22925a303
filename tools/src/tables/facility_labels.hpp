// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// Clusters of about `size` points by facility location: the hierarchy of clusters that a store has
/// is made in memory, and of its levels that one is taken whose clusters come nearest to `size` on
/// average (as a factor). Blocks are compact sets of the points, whatever their order.
///
/// Returns the cluster of each point, numbered from 0 without gaps; the same for any number of
/// threads. `progress` is called with the points done; what it throws ends the work. O(n log n).
std::vector<std::uint32_t> facility_labels(std::span<const stream::Point3> points, double size,
                                           std::uint64_t seed, unsigned threads,
                                           const std::function<void(std::uint64_t)>& progress);

}  // namespace terrace::tools
