// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// The data of a facility location problem, scaled so that squares neither overflow nor underflow.
/// Lengths, weights and costs are divided by powers of two, which is exact.
struct SearchFrame {
  std::vector<Point3> points;    ///< approximately in the unit cube; mapped if the metric is linear
  std::vector<double> channels;  ///< values times channel weights, row by row
  std::size_t channel_count = 0;
  std::vector<double> weights;  ///< the greatest is in [0.5, 1)
  double facility_cost = 0.0;   ///< finite
  double outlier_price = 0.0;   ///< price of a client of weight 1; may be infinite
  int cost_exponent = 0;        ///< a cost times 2 to this power is in the unit of the metric
  /// In the unit of the metric; infinite beyond the range of double.
  double true_facility_cost = 0.0;
};

/// Requires: check(problem) has passed. For entities the frame has no points.
[[nodiscard]] SearchFrame make_frame(const FacilityPoints& problem);
[[nodiscard]] SearchFrame make_frame(const FacilityEntities& problem);

}  // namespace terrace::cluster
