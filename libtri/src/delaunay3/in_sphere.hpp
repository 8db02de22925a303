// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

/// The determinant of the sphere test in double, two lanes wide: SSE2 and NEON have them, so every
/// machine runs the same operations in the same order.

namespace terrace::tri::spatial {

using Pair = double __attribute__((vector_size(16)));

/// What a filter says of the place of a point with respect to a sphere.
enum class Verdict : std::uint8_t { kOut, kIn, kOn, kOpen };  ///< kOpen: to be decided exactly

/// Four vectors from the tested point to the corners a, b, c, d: coordinates of a and b, of c and
/// d.
struct Rows {
  Pair x01, x23, y01, y23, z01, z23;
};

struct InSphere {
  double value;    ///< > 0 inside, up to rounding
  double largest;  ///< the largest square of the length of a row
};

inline Pair cross_lanes(Pair low, Pair high) { return __builtin_shufflevector(low, high, 1, 2); }

/// The four 3 x 3 minors are one expression turned round cyclically, so two lanes do the work of
/// two rows (after J. R. Shewchuk's insphere(), doi:10.1007/PL00009321).
[[gnu::always_inline]] inline InSphere in_sphere_value(const Rows& r) {
  const Pair x12 = cross_lanes(r.x01, r.x23), x30 = cross_lanes(r.x23, r.x01);
  const Pair y12 = cross_lanes(r.y01, r.y23), y30 = cross_lanes(r.y23, r.y01);
  const Pair z12 = cross_lanes(r.z01, r.z23), z30 = cross_lanes(r.z23, r.z01);
  const Pair m01 = r.x01 * y12 - x12 * r.y01;    // ab, bc
  const Pair m23 = r.x23 * y30 - x30 * r.y23;    // cd, da
  const Pair n = r.x01 * r.y23 - r.x23 * r.y01;  // ac, bd
  const Pair m12 = cross_lanes(m01, m23), m30 = cross_lanes(m23, m01);
  const Pair c01 = r.z01 * m12 + r.z23 * m01 - z12 * n;  // abc, bcd
  const Pair c23 = r.z23 * m30 + r.z01 * m23 + z30 * n;  // cda, dab
  const Pair l01 = r.x01 * r.x01 + r.y01 * r.y01 + r.z01 * r.z01;
  const Pair l23 = r.x23 * r.x23 + r.y23 * r.y23 + r.z23 * r.z23;
  const Pair l12 = cross_lanes(l01, l23), l30 = cross_lanes(l23, l01);
  const Pair sum = c01 * l30 + c23 * l12;
  const Pair more = l01 > l23 ? l01 : l23;
  return {sum[1] - sum[0], more[0] > more[1] ? more[0] : more[1]};
}

}  // namespace terrace::tri::spatial
