// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace terrace::tri::planar {

/// A number of 113 bits with a bound on its distance from the exact result of the operations that
/// led to it. It is ten times faster than rationals, whose digits grow. If the bound is small
/// enough, the double nearest to the exact result is known for certain.
class BoundedNumber {
 public:
  using Wide = boost::multiprecision::cpp_bin_float_quad;

  BoundedNumber(double value = 0) : value_(value) {}  // NOLINT: implicit, as in rationals

  [[nodiscard]] const Wide& value() const { return value_; }
  [[nodiscard]] double error() const { return error_; }

  /// The double nearest to the exact result, or NaN if the bound leaves it undecided.
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
    // Lower bound of the divisor's absolute value.
    const double least = std::abs(b.value_.convert_to<double>()) * (1 - 0x1p-50) - b.error_;
    if (!(least > 0x1p-1000)) return {quotient, std::numeric_limits<double>::infinity()};
    return {quotient, (a.error_ + size_of(quotient) * b.error_) / least};
  }
  BoundedNumber& operator+=(const BoundedNumber& other) { return *this = *this + other; }
  BoundedNumber& operator-=(const BoundedNumber& other) { return *this = *this - other; }

 private:
  /// error: the error due to the operands. Adds the rounding of the operation itself, and the loss
  /// of the bound's doubles by rounding and underflow.
  BoundedNumber(const Wide& value, double error)
      : value_(value), error_((error + size_of(value) * 0x1p-112) * (1 + 0x1p-40) + 0x1p-1000) {}

  /// Upper bound of the absolute value, except for rounding.
  static double size_of(const Wide& value) {
    return std::abs(value.convert_to<double>()) + std::numeric_limits<double>::min();
  }
  [[nodiscard]] double size() const { return size_of(value_); }

  Wide value_;
  double error_ = 0;
};

}  // namespace terrace::tri::planar
