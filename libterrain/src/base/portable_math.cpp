// SPDX-License-Identifier: Apache-2.0
#include "base/portable_math.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::terrain {
namespace {

/// sin(x) for |x| <= pi/4 + a little: Taylor's series in Horner's form.
double sin_series(double x) {
  const double square = x * x;
  double sum = 0;
  for (int k = 9; k >= 1; --k) {
    sum = (1.0 + sum) * (-square / static_cast<double>(2 * k * (2 * k + 1)));
  }
  return x + x * sum;
}

/// ln 2 in two parts, the first with trailing zeros, so that whole multiples of it are exact.
constexpr double kLn2High = 0x1.62e42fefa0000p-1;
constexpr double kLn2Low = 0x1.cf79abc9e3b3ap-40;

/// cos(x) for |x| <= pi/4 + a little.
double cos_series(double x) {
  const double square = x * x;
  double sum = 0;
  for (int k = 9; k >= 1; --k) {
    sum = (1.0 + sum) * (-square / static_cast<double>(2 * k * (2 * k - 1)));
  }
  return 1.0 + sum;
}

}  // namespace

double portable_sin_degrees(double degrees) {
  // fmod and the subtraction of multiples of 90 are exact, so the reduction loses nothing.
  double angle = std::fmod(degrees, 360.0);
  if (std::isnan(angle)) return angle;  // NaN or infinite input
  const double quarter = std::nearbyint(angle / 90.0);
  angle -= quarter * 90.0;
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return sin_series(angle * kDegree);
    case 1:
      return cos_series(angle * kDegree);
    case 2:
      return -sin_series(angle * kDegree);
    default:
      return -cos_series(angle * kDegree);
  }
}

double portable_cos_degrees(double degrees) {
  double angle = std::fmod(degrees, 360.0);
  if (std::isnan(angle)) return angle;  // NaN or infinite input
  const double quarter = std::nearbyint(angle / 90.0);
  angle -= quarter * 90.0;
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return cos_series(angle * kDegree);
    case 1:
      return -sin_series(angle * kDegree);
    case 2:
      return -cos_series(angle * kDegree);
    default:
      return sin_series(angle * kDegree);
  }
}

double portable_exp(double x) {
  if (std::isnan(x)) return x;
  x = std::clamp(x, -700.0, 700.0);
  // x = k ln 2 + r with |r| <= ln(2)/2.
  const double k = std::nearbyint(x * 1.4426950408889634074);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1;
  for (int n = 17; n >= 1; --n) sum = 1.0 + sum * (r / n);
  return std::ldexp(sum, static_cast<int>(k));
}

double portable_hypot(double x, double y) {
  const double squares = x * x + y * y;
  if (squares > 1e-280 && squares < 1e300) return std::sqrt(squares);
  const double largest = std::max(std::abs(x), std::abs(y));
  if (largest == 0.0 || std::isinf(largest)) return largest;
  x /= largest;
  y /= largest;
  return largest * std::sqrt(x * x + y * y);
}

double portable_exp2(double x) { return portable_exp(x * 0.69314718055994530942); }

}  // namespace terrace::terrain
