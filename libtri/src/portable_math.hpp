// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

/// Replacements for functions of the C library whose last bit differs between releases and
/// processors, made of +, -, *, / and sqrt alone, which IEEE 754 defines exactly, so that triangles
/// and numbers are the same everywhere. (remquo is exact.)

namespace terrace::tri::portable {

/// Sine and cosine of an angle in degrees, within 2e-16; exact at multiples of 90.
inline std::array<double, 2> sine_cosine(double degrees) {
  int quarter = 0;
  const double x = std::remquo(degrees, 90.0, &quarter) * (std::numbers::pi / 180.0);
  // Taylor series; |x| <= pi / 4.
  double s = 0.0, c = 0.0;
  for (int k = 9; k >= 1; --k) {
    s = (1.0 + s) * (-x * x / (2 * k * (2 * k + 1)));
    c = (1.0 + c) * (-x * x / (2 * k * (2 * k - 1)));
  }
  s = x + x * s;
  c = 1.0 + c;
  switch (quarter & 3) {
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

/// sqrt(x^2 + y^2), also where the squares would overflow or underflow.
inline double length(double x, double y) {
  const double squares = x * x + y * y;
  if (squares > 1e-280 && squares < 1e300) return std::sqrt(squares);
  const double largest = std::max(std::abs(x), std::abs(y));
  if (largest == 0.0 || std::isinf(largest)) return largest;
  x /= largest;
  y /= largest;
  return largest * std::sqrt(x * x + y * y);
}

/// The angle of the vector (x, y) from the x axis in degrees, -180 to 180, with a relative error of
/// 4e-16; exact at multiples of 45. As with atan2(y, x): 0 or 180 with the sign of y if y is zero.
inline double angle_degrees(double y, double x) {
  const double a = std::abs(x), b = std::abs(y);
  if (std::isnan(a) || std::isnan(b)) return a + b;
  // The tangent, at most 1: the angle of the nearest eighth is known; the series gives the
  // difference.
  double t = a == b ? 1.0 : std::min(a, b) / std::max(a, b);
  if (b == 0.0) t = 0.0;
  static constexpr std::array<double, 9> kEighths{0.0,
                                                  7.125016348901798,
                                                  14.036243467926479,
                                                  20.556045219583464,
                                                  26.56505117707799,
                                                  32.005383208083494,
                                                  36.86989764584402,
                                                  41.18592516570965,
                                                  45.0};
  const int eighth = static_cast<int>(t * 8.0 + 0.5);
  t = (t - eighth / 8.0) / (1.0 + t * (eighth / 8.0));
  const double q = t * t;  // at most 1 / 256
  double sum = 0.0;
  for (const double c :
       {1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3})
    sum = q * (c - sum);
  double degrees =
      kEighths[static_cast<std::size_t>(eighth)] + (t - t * sum) * (180.0 / std::numbers::pi);
  if (b > a) degrees = 90.0 - degrees;
  if (std::signbit(x)) degrees = 180.0 - degrees;
  return std::copysign(degrees, y);
}

/// ln 2 in two parts, the first with trailing zeros, so that integer multiples of it are exact.
inline constexpr double kLn2High = 0x1.62e42fefa0000p-1, kLn2Low = 0x1.cf79abc9e3b3ap-40;

/// e^x, within 1e-15 relative for |x| <= 700; clamped beyond.
inline double exponential(double x) {
  if (std::isnan(x)) return x;
  x = std::clamp(x, -700.0, 700.0);
  // x = k ln 2 + r with |r| <= ln(2) / 2.
  const double k = std::nearbyint(x * 1.4426950408889634074);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1;
  for (int n = 17; n >= 1; --n) sum = 1.0 + sum * (r / n);
  return std::ldexp(sum, static_cast<int>(k));
}

/// Natural logarithm of a positive finite number, within 1e-15 relative.
inline double logarithm(double x) {
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
  return e * kLn2High + (e * kLn2Low + 2.0 * (s + s * sum));
}

}  // namespace terrace::tri::portable
