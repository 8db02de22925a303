// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Blocks of fewer points are searched in full, because a reduced search is up to 30 % worse there
/// (thesis table 7.5).
inline constexpr std::size_t kFullSearchBelow = 2500;

/// Runs BlockClusterer under a metric that a linear map of the points makes Euclidean. The facility
/// cost comes from the problem, as a multiple of the diagonal in that metric, and not from the
/// options. The costs in `result` are those of the mapped points, so callers must not use them.
///
/// Requires: check(problem) has passed, linear_map() exists on the bounding box of the points, and
/// the problem has neither channels nor outliers.
void run_linear(BlockClusterer& clusterer, const FacilityPoints& problem, BlockOptions options,
                BlockClustering& result);

}  // namespace terrace::cluster
