// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// L(v) as computed, and an upper bound of the amount by which rounding may have raised it.
struct DualValue {
  double value = 0.0;
  double error = 0.0;
  [[nodiscard]] double safe() const { return value - error; }
};

/// Adds up L(v) = sum v_i + sum_j min(0, opening_j - paid_j) and bounds the rounding errors. For
/// each of the sums they are at most (terms) epsilon/2 times the sum of absolute values. Twice that
/// is subtracted.
class DualSum {
 public:
  /// `terms`: the largest number of differences v_i - c_ij in one value of `paid`.
  explicit DualSum(std::size_t terms) : terms_(static_cast<double>(terms) + 8.0) {}
  void client(double dual) {
    value_ += dual;
    magnitude_ += std::abs(dual);
    count_ += 1.0;
  }
  void facility(double opening, double paid) {
    // Up to rounding, a facility that seems not quite paid for may be paid.
    paid_ += paid + opening;
    if (paid > opening) value_ += opening - paid;
    count_ += 1.0;
  }
  [[nodiscard]] DualValue value() const {
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    return {value_, kEpsilon * (terms_ * paid_ + (count_ + 8.0) * (magnitude_ + paid_)) +
                        (terms_ + count_) * std::numeric_limits<double>::min()};
  }

 private:
  double terms_;
  double value_ = 0.0, magnitude_ = 0.0, paid_ = 0.0, count_ = 0.0;
};

/// L and its supergradient, for any kind of problem.
class DualFunction {
 public:
  virtual ~DualFunction() = default;
  /// Evaluates L. Sets slope[i] to the weight of client i times (1 - number of paid facilities that
  /// connect it for less than its dual).
  virtual DualValue evaluate(std::span<const double> duals, std::span<double> slope) = 0;
  /// Clamps duals to the range that contains the maximum.
  virtual void clamp(std::span<double> duals) const = 0;
};

/// Makes subgradient steps from `duals` towards `target`, the cost of a solution. Replaces `duals`
/// by the best ones found and returns the safe value there. The step is Polyak's, halved after a
/// number of steps without gain. Of the options it uses `steps` and `progress`.
double ascend(DualFunction& function, std::vector<double>& duals, double target,
              const LowerBoundOptions& options);

}  // namespace terrace::cluster
