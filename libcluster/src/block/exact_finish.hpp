// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "scaling.hpp"
#include "terrace/cluster/block.hpp"

namespace terrace::cluster {

/// The last step of clustering a block, in double precision. Adds up the cost, and opens facilities
/// at points that single precision cannot distinguish from their facility although they pay more
/// than a facility costs (close pairs of great weight).
class ExactFinish {
 public:
  /// Changes facilities and assignment of `clustering` if necessary. facility_cost is scaled.
  /// Returns the scaled connection cost. Throws whatever the stop check throws.
  double run(std::span<const Point3> points, std::span<const double> weights,
             const Scaling& scaling, double facility_cost, const base::StopCheck& check_stop,
             BlockClustering& clustering);

 private:
  struct Costs {
    double sum = 0.0, greatest = 0.0;
    std::uint32_t where = 0;  ///< the point with the greatest cost
  };
  [[nodiscard]] Costs costs(std::span<const Point3> points, std::span<const double> weights,
                            const Scaling& scaling, const BlockClustering& clustering) const;

  std::vector<Point3> facilities_;  // scaled
};

}  // namespace terrace::cluster
