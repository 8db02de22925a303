// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

namespace terrace::terrain {

/// Multiples of a step in decimal arithmetic: three times 0.1 is 0.3, not 0.30000000000000004, the
/// product of the doubles. Each is the double nearest to the decimal product, if that has at most
/// 15 digits.
class DecimalMultiples {
 public:
  /// step: positive and finite.
  explicit DecimalMultiples(double step);

  [[nodiscard]] double step() const { return step_; }
  /// count: an integer, or 1.5.
  [[nodiscard]] double operator()(double count) const {
    // Both factors are exact, so the quotient is rounded once.
    const double digits = count * digits_;
    return std::abs(digits) <= kExact ? digits / power_ : count * step_;
  }
  [[nodiscard]] double operator()(std::int64_t count) const {
    return (*this)(static_cast<double>(count));
  }

 private:
  static constexpr double kExact = 0x1p53;

  double step_;
  double digits_, power_ = 1;  ///< the step is digits_ / power_
};

}  // namespace terrace::terrain
