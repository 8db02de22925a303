// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

/// Replacements for functions of the C library whose last bit differs between releases and
/// processors, made of +, -, *, / and sqrt alone, which IEEE 754 defines exactly, so that clusters
/// are the same everywhere. (fmod, remquo, frexp and ldexp are exact.)

namespace terrace::cluster::portable {

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

/// c[0] + c[1] x + c[2] x^2 + ..., even and odd terms separately, which processors do in parallel.
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

/// x^p for finite x >= 0 and p > 0, within 1e-15 for results of about 1; 0 and 1 are exact.
inline double power(double x, double p) {
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
  // ln 2 in two parts, the first with trailing zeros, so that integer multiples of it are exact.
  constexpr double kLn2High = 0x1.62e42fefa0000p-1, kLn2Low = 0x1.cf79abc9e3b3ap-40;
  // x = m 2^e with m from sqrt(1/2) to sqrt(2); ln m = 2 artanh(s).
  int e = 0;
  if (x < std::numeric_limits<double>::min()) {  // subnormal
    x *= 0x1p64;
    e = -64;
  }
  const auto bits = std::bit_cast<std::uint64_t>(x);
  // Mantissas of at least sqrt(1/2) count towards the next power of two.
  const std::uint64_t up = bits + (0x3ff0000000000000 - 0x3fe6a09e667f3bcd);
  e += static_cast<int>(up >> 52) - 1023;
  const double m = std::bit_cast<double>(bits - ((up & 0xfff0000000000000) - 0x3ff0000000000000));
  const double s = (m - 1.0) / (m + 1.0), q = s * s;
  const double low = e * kLn2Low + 2.0 * (s + s * (q * polynomial(kLogarithm, q)));
  const double y = p * (e * kLn2High + low);
  // e^y = 2^k e^r with |r| <= ln(2) / 2.
  const double bounded = std::clamp(y, -746.0, 710.0);
  const int k = static_cast<int>(bounded * std::numbers::log2e + (y < 0.0 ? -0.5 : 0.5));
  const double r = (bounded - k * kLn2High) - k * kLn2Low;
  const double result = polynomial(kExponential, r);
  if (std::abs(k) > 1000) return std::ldexp(result, k);
  return result * std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

}  // namespace terrace::cluster::portable
