// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Leaves points out of a clustering made without regard to problem.outlier_price, where that
/// lowers the cost. This affects members farther from their facility than the price, and whole
/// clusters that cost more than their members would pay elsewhere or for being left out. Such
/// members are assigned to kOutlier; the other members of such a cluster go to the nearest
/// remaining facility. `facilities` keeps the facilities without a cluster, and at least one
/// facility keeps its cluster.
///
/// Requires a metric that is linear on the bounding box of the points, without weights and
/// channels. Does nothing if there is no price. Takes O(n), and O(k) for each member of a cluster
/// that is small enough to be worth less than its facility.
void leave_out(const FacilityPoints& problem, BlockClustering& clustering);

}  // namespace terrace::cluster
