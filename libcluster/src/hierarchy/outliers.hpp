// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Leaves points out of a clustering that was made without regard to problem.outlier_price, where
/// that lowers the cost: members farther from their facility than the price, and whole clusters
/// that cost more than what their members pay elsewhere or for being left out. Their assignment
/// becomes kOutlier; what else was in such a cluster goes to the nearest facility that remains.
/// `facilities` keeps those without a cluster; at least one keeps its own. For a metric
/// that is linear on the box of the points, without weights and channels. Nothing happens without a
/// price. O(n), and O(k) for each member of a cluster that is small enough to be worth less than
/// its facility.
void leave_out(const FacilityPoints& problem, BlockClustering& clustering);

}  // namespace terrace::cluster
