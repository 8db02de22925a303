// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

/// Mathematical functions with the same bits on every machine. The functions of the C library round
/// differently from release to release and from processor to processor. These use only +, -, *, /
/// and sqrt, which IEEE 754 defines exactly, and fmod, remquo, frexp, ldexp and nearbyint, which
/// are exact. Requires -ffp-contract=off.

namespace terrace::base {

/// As std::bit_cast, which the standard library of Emscripten 3.1.6 lacks.
template <class To, class From>
[[nodiscard]] constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return __builtin_bit_cast(To, from);
}

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

namespace portable {

/// ln 2 in two parts, the first with trailing zeros, so that integer multiples of it are exact.
inline constexpr double kLn2High = 0x1.62e42fefa0000p-1, kLn2Low = 0x1.cf79abc9e3b3ap-40;

/// Returns sin(x) for |x| <= pi / 4 by Taylor's series.
inline double sine_series(double x) {
  double sum = 0.0;
  for (int k = 9; k >= 1; --k) sum = (1.0 + sum) * (-x * x / (2 * k * (2 * k + 1)));
  return x + x * sum;
}
/// Returns cos(x) for |x| <= pi / 4 by Taylor's series.
inline double cosine_series(double x) {
  double sum = 0.0;
  for (int k = 9; k >= 1; --k) sum = (1.0 + sum) * (-x * x / (2 * k * (2 * k - 1)));
  return 1.0 + sum;
}
/// Returns the radians from the nearest multiple of 90 degrees, and that multiple modulo 4.
struct Reduced {
  double radians;
  int quarter;
};
inline Reduced reduced(double degrees) {
  int quarter = 0;
  const double remainder = std::remquo(degrees, 90.0, &quarter);
  return {remainder * kRadiansPerDegree, quarter & 3};
}

}  // namespace portable

/// Returns the sine of an angle in degrees, within 2e-16. It is exact at multiples of 90, and NaN
/// for infinite angles.
inline double sin_degrees(double degrees) {
  const auto [x, quarter] = portable::reduced(degrees);
  const double value = quarter % 2 == 0 ? portable::sine_series(x) : portable::cosine_series(x);
  return quarter < 2 ? value : -value;
}
/// Returns the cosine of an angle in degrees, as sin_degrees() returns the sine.
inline double cos_degrees(double degrees) {
  const auto [x, quarter] = portable::reduced(degrees);
  const double value = quarter % 2 == 0 ? portable::cosine_series(x) : portable::sine_series(x);
  return quarter == 1 || quarter == 2 ? -value : value;
}
/// Returns {sine, cosine} of an angle in degrees.
inline std::array<double, 2> sin_cos_degrees(double degrees) {
  const auto [x, quarter] = portable::reduced(degrees);
  const double s = portable::sine_series(x), c = portable::cosine_series(x);
  switch (quarter) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// Returns the angle of the vector (x, y) from the x axis in degrees, from -180 to 180, with a
/// relative error of 4e-16. It is exact at multiples of 45. If y is zero, the result is 0 or 180
/// with the sign of y, as for atan2(y, x).
inline double atan2_degrees(double y, double x) {
  const double a = std::abs(x), b = std::abs(y);
  if (std::isnan(a) || std::isnan(b)) return a + b;
  // The tangent is at most 1. The table has the angle of the nearest eighth, and the series adds
  // the difference.
  double t = a == b ? 1.0 : std::min(a, b) / std::max(a, b);
  if (b == 0.0) t = 0.0;
  constexpr std::array<double, 9> kEighths{0.0,
                                           7.125016348901798,
                                           14.036243467926479,
                                           20.556045219583464,
                                           26.56505117707799,
                                           32.005383208083494,
                                           36.86989764584402,
                                           41.18592516570965,
                                           45.0};
  // In the middle between two eighths either will do.
  const int eighth = static_cast<int>(t * 8.0 + 0.5);  // NOLINT(bugprone-incorrect-roundings)
  t = (t - eighth / 8.0) / (1.0 + t * (eighth / 8.0));
  const double q = t * t;  // at most 1 / 256
  double sum = 0.0;
  for (const double c :
       {1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3}) {
    sum = q * (c - sum);
  }
  double degrees =
      kEighths[static_cast<std::size_t>(eighth)] + (t - t * sum) * (180.0 / std::numbers::pi);
  if (b > a) degrees = 90.0 - degrees;
  if (std::signbit(x)) degrees = 180.0 - degrees;
  return std::copysign(degrees, y);
}

/// Returns sqrt(x^2 + y^2), even if the squares would overflow or underflow.
inline double hypot(double x, double y) {
  const double squares = x * x + y * y;
  if (squares > 1e-280 && squares < 1e300) return std::sqrt(squares);
  const double largest = std::max(std::abs(x), std::abs(y));
  if (largest == 0.0 || std::isinf(largest)) return largest;
  x /= largest;
  y /= largest;
  return largest * std::sqrt(x * x + y * y);
}

/// Returns e^x with a relative error of 1e-15. Clamps x to [-700, 700].
inline double exp(double x) {
  if (std::isnan(x)) return x;
  x = std::clamp(x, -700.0, 700.0);
  // x = k ln 2 + r with |r| <= ln(2) / 2.
  const double k = std::nearbyint(x * std::numbers::log2e);
  const double r = (x - k * portable::kLn2High) - k * portable::kLn2Low;
  double sum = 1;
  for (int n = 17; n >= 1; --n) sum = 1.0 + sum * (r / n);
  return std::ldexp(sum, static_cast<int>(k));
}
/// Returns 2^x, computed as exp(x ln 2).
inline double exp2(double x) { return exp(x * std::numbers::ln2); }

/// Returns the natural logarithm of a positive finite number, with a relative error of 1e-15.
inline double log(double x) {
  // x = m 2^e with m from sqrt(1/2) to sqrt(2); ln m = 2 artanh(s) by its series.
  int e = 0;
  double m = std::frexp(x, &e);
  if (m < 0.70710678118654752440) {
    m += m;
    --e;
  }
  const double s = (m - 1.0) / (m + 1.0), square = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = (sum + 1.0 / k) * square;
  return e * portable::kLn2High + (e * portable::kLn2Low + 2.0 * (s + s * sum));
}

/// Returns c[0] + c[1] x + c[2] x^2 + ... Sums even and odd terms separately, because processors
/// compute the two sums in parallel.
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double x) {
  const double square = x * x;
  double even = 0.0, odd = 0.0;
  for (std::size_t n = (N + 1) / 2; n-- > 0;) {
    even = even * square + c[2 * n];
    if (2 * n + 1 < N) odd = odd * square + c[2 * n + 1];
  }
  return even + odd * x;
}

/// Returns x^p for finite x >= 0 and p > 0, within 1e-15 for results of about 1. Results of 0 and 1
/// are exact. Faster than exp(p * log(x)).
inline double pow(double x, double p) {
  if (!(x > 0.0)) return x;
  if (p == 2.0) return x * x;
  if (p == 3.0) return x * x * x;
  if (p == 0.5) return std::sqrt(x);
  // 1 / (2 n + 3) and 1 / n!.
  static constexpr auto kLogarithm = [] {
    std::array<double, 11> c{};
    for (std::size_t n = 0; n < c.size(); ++n) c[n] = 1.0 / static_cast<double>(2 * n + 3);
    return c;
  }();
  static constexpr auto kExponential = [] {
    std::array<double, 15> c{1.0};
    for (std::size_t n = 1; n < c.size(); ++n) c[n] = c[n - 1] / static_cast<double>(n);
    return c;
  }();
  // x = m 2^e with m from sqrt(1/2) to sqrt(2); ln m = 2 artanh(s).
  int e = 0;
  if (x < std::numeric_limits<double>::min()) {  // subnormal
    x *= 0x1p64;
    e = -64;
  }
  const auto bits = bit_cast<std::uint64_t>(x);
  // Mantissas of at least sqrt(1/2) count towards the next power of two.
  const std::uint64_t up = bits + (0x3ff0000000000000 - 0x3fe6a09e667f3bcd);
  e += static_cast<int>(up >> 52) - 1023;
  const double m = bit_cast<double>(bits - ((up & 0xfff0000000000000) - 0x3ff0000000000000));
  const double s = (m - 1.0) / (m + 1.0), q = s * s;
  const double low = e * portable::kLn2Low + 2.0 * (s + s * (q * polynomial(kLogarithm, q)));
  const double y = p * (e * portable::kLn2High + low);
  // e^y = 2^k e^r with |r| <= ln(2) / 2.
  const double bounded = std::clamp(y, -746.0, 710.0);
  const int k = static_cast<int>(bounded * std::numbers::log2e + (y < 0.0 ? -0.5 : 0.5));
  const double r = (bounded - k * portable::kLn2High) - k * portable::kLn2Low;
  const double result = polynomial(kExponential, r);
  if (std::abs(k) > 1000) return std::ldexp(result, k);
  return result * bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

}  // namespace terrace::base
