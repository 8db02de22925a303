// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Blocks of fewer points are searched in full: there a reduced search is up to 30 % worse (thesis
/// table 7.5).
inline constexpr std::size_t kFullSearchBelow = 2500;

/// BlockClusterer on points of a metric that is linear on their bounding box, whose diagonal is
/// that of the metric. Requires: its linear_map(), no channels, no outliers, check(problem). The
/// costs in `result` are those of the mapped points and must not be used. The facility cost of the
/// options is set by the problem.
void run_linear(BlockClusterer& clusterer, const FacilityPoints& problem, BlockOptions options,
                BlockClustering& result);

}  // namespace terrace::cluster
