// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "terrace/cluster/facility.hpp"

namespace terrace::cluster {

/// The costs of a problem of points written out, so that what is made for matrices can take it.
struct PointMatrix {
  std::vector<double> opening, connection;

  [[nodiscard]] FacilityMatrix view() const {
    return {opening.size(), opening.size(), opening, connection};
  }
};

/// Every point is a facility and a client. A client whose connection would cost more than the price
/// of leaving it out (outlier_price) pays that price to whatever facility it is connected to.
/// 8 n^2 bytes, O(n^2) distances.
/// Throws: std::invalid_argument as check(problem); if the bytes exceed `memory_limit` (0: no
/// limit), saying how many they are; and if a cost is beyond the range of double, as check() of the
/// matrix says it. std::bad_alloc.
[[nodiscard]] PointMatrix point_matrix(const FacilityPoints& problem,
                                       std::uint64_t memory_limit = 0);

}  // namespace terrace::cluster
