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

/// Runs BlockClusterer on points under a metric that is linear on their bounding box, with the
/// diagonal of that metric. The costs in `result` are those of the mapped points and must not be
/// used. The problem sets the facility cost of the options.
/// Requires: the metric has a linear_map() there, no channels, no outliers, check(problem) has
/// passed.
void run_linear(BlockClusterer& clusterer, const FacilityPoints& problem, BlockOptions options,
                BlockClustering& result);

}  // namespace terrace::cluster
