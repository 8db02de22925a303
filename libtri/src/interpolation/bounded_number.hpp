// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace terrace::tri::planar {

/// A number of 113 bits and a bound on its distance from the exact result of the operations that
/// led to it. Ten times faster than rationals, whose digits grow; and where the bound is small
/// enough, the double nearest to the exact result is known for certain.
class BoundedNumber {
 public:
  using Wide = boost::multiprecision::cpp_bin_float_quad;

  BoundedNumber(double value = 0) : value_(value) {}  // NOLINT: as rationals

  [[nodiscard]] const Wide& value() const { return value_; }
  [[nodiscard]] double error() const { return error_; }

  /// The double nearest to the exact result, or NaN if the bound leaves that open.
  [[nodiscard]] double rounded() const {
    const double low = Wide(value_ - 2 * error_).convert_to<double>();
    const double high = Wide(value_ + 2 * error_).convert_to<double>();
    return low == high ? low : std::numeric_limits<double>::quiet_NaN();
  }

  friend BoundedNumber operator+(const BoundedNumber& a, const BoundedNumber& b) {
    return {a.value_ + b.value_, a.error_ + b.error_};
  }
  friend BoundedNumber operator-(const BoundedNumber& a, const BoundedNumber& b) {
    return {a.value_ - b.value_, a.error_ + b.error_};
  }
  friend BoundedNumber operator*(const BoundedNumber& a, const BoundedNumber& b) {
    return {a.value_ * b.value_, a.error_ * b.size() + b.error_ * a.size() + a.error_ * b.error_};
  }
  friend BoundedNumber operator/(const BoundedNumber& a, const BoundedNumber& b) {
    const Wide quotient = a.value_ / b.value_;
    // The divisor may be as small as this.
    const double least = std::abs(b.value_.convert_to<double>()) * (1 - 0x1p-50) - b.error_;
    if (!(least > 0x1p-1000)) return {quotient, std::numeric_limits<double>::infinity()};
    return {quotient, (a.error_ + size_of(quotient) * b.error_) / least};
  }
  BoundedNumber& operator+=(const BoundedNumber& other) { return *this = *this + other; }
  BoundedNumber& operator-=(const BoundedNumber& other) { return *this = *this - other; }

 private:
  /// error: that of the operands makes; the operation's own rounding is added, and what the doubles
  /// of the bound lose by rounding and underflow.
  BoundedNumber(const Wide& value, double error)
      : value_(value), error_((error + size_of(value) * 0x1p-112) * (1 + 0x1p-40) + 0x1p-1000) {}

  /// Not below the value's, but for rounding.
  static double size_of(const Wide& value) {
    return std::abs(value.convert_to<double>()) + std::numeric_limits<double>::min();
  }
  [[nodiscard]] double size() const { return size_of(value_); }

  Wide value_;
  double error_ = 0;
};

}  // namespace terrace::tri::planar
