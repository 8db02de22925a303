// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Functions with the same bits on every machine. The C library's versions may round differently
/// from release to release and processor to processor, and clusters and files would differ. Only +,
/// -, *, / and sqrt are used, which IEEE 754 fixes.

namespace terrace::terrain {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180.0;  ///< radians

/// Sine of an angle in degrees. Any finite angle; within 2e-16 for |degrees| <= 360.
double portable_sin_degrees(double degrees);
/// Cosine likewise; exactly 0 at odd multiples of 90 degrees.
double portable_cos_degrees(double degrees);
/// e^x, within 1e-15 relative for |x| <= 700; clamped beyond.
double portable_exp(double x);
/// 2^x likewise.
double portable_exp2(double x);

/// sqrt(x^2 + y^2), where the squares would overflow or vanish as well.
double portable_hypot(double x, double y);

/// A bijective scrambling of 64 bits (the finaliser of splitmix64, Steele et al. 2014,
/// doi:10.1145/2660193.2660195).
constexpr std::uint64_t scramble(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

/// The upper 53 bits as a double in [0, 1).
constexpr double unit_interval(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

}  // namespace terrace::terrain
