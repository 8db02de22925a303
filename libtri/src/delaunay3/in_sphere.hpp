// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

/// The determinant of the sphere test in double, two lanes wide. SSE2 and NEON both have such
/// lanes, so every machine executes the same operations in the same order.

namespace terrace::tri::spatial {

using Pair = double __attribute__((vector_size(16)));

/// A filter's verdict on the position of a point relative to a sphere.
enum class Verdict : std::uint8_t { out, in, open };  ///< open: needs an exact test

/// Four vectors from the tested point to the corners a, b, c, d: the coordinates of a and b, then
/// those of c and d.
struct Rows {
  Pair x01, x23, y01, y23, z01, z23;
};

struct InSphere {
  double value;    ///< > 0 inside, up to rounding
  double largest;  ///< the largest squared length of a row
};

inline Pair cross_lanes(Pair low, Pair high) { return __builtin_shufflevector(low, high, 1, 2); }

/// The four 3 x 3 minors are cyclic permutations of one expression, so two lanes compute two of
/// them at a time (after J. R. Shewchuk's insphere(), doi:10.1007/PL00009321).
struct Minors {
  Pair c01, c23;  ///< of rows abc and bcd, cda and dab
};
[[gnu::always_inline]] inline Minors minors(const Rows& r) {
  const Pair x12 = cross_lanes(r.x01, r.x23), x30 = cross_lanes(r.x23, r.x01);
  const Pair y12 = cross_lanes(r.y01, r.y23), y30 = cross_lanes(r.y23, r.y01);
  const Pair z12 = cross_lanes(r.z01, r.z23), z30 = cross_lanes(r.z23, r.z01);
  const Pair m01 = r.x01 * y12 - x12 * r.y01;    // ab, bc
  const Pair m23 = r.x23 * y30 - x30 * r.y23;    // cd, da
  const Pair n = r.x01 * r.y23 - r.x23 * r.y01;  // ac, bd
  const Pair m12 = cross_lanes(m01, m23), m30 = cross_lanes(m23, m01);
  return {r.z01 * m12 + r.z23 * m01 - z12 * n, r.z23 * m30 + r.z01 * m23 + z30 * n};
}

[[gnu::always_inline]] inline InSphere in_sphere_value(const Rows& r) {
  const auto [c01, c23] = minors(r);
  const Pair l01 = r.x01 * r.x01 + r.y01 * r.y01 + r.z01 * r.z01;
  const Pair l23 = r.x23 * r.x23 + r.y23 * r.y23 + r.z23 * r.z23;
  const Pair l12 = cross_lanes(l01, l23), l30 = cross_lanes(l23, l01);
  const Pair sum = c01 * l30 + c23 * l12;
  const Pair more = l01 > l23 ? l01 : l23;
  return {sum[1] - sum[0], more[0] > more[1] ? more[0] : more[1]};
}

/// in_sphere_value() of integers is exact if largest^5 is below this. With L for `largest`, a 2 x 2
/// minor is at most L, summed over its products, a 3 x 3 minor 3 L^1.5 and the value 12 L^2.5 <
/// 2^53. Coordinates of a row are then below 2^10.
inline constexpr double kExactFifth = 5.6e29;

/// inside_perturbed_sphere() for integers (or integer multiples of a power of two) of that size.
/// Signs of 3 x 3 minors are orientations with the tested point in place of a corner. Each row
/// packs into one number in lexicographic order, which is 0 for the tested point.
[[gnu::noinline]] inline bool inside_small_perturbed_sphere(const Rows& r) {
  constexpr double kShift = 2048;
  const Pair key01 = (r.x01 * kShift + r.y01) * kShift + r.z01;
  const Pair key23 = (r.x23 * kShift + r.y23) * kShift + r.z23;
  std::array<double, 4> key = {key01[0], key01[1], key23[0], key23[1]};
  const Minors minor = minors(r);
  const std::array<double, 4> turn = {minor.c01[1], -minor.c23[0], minor.c23[1], -minor.c01[0]};
  while (true) {
    const std::size_t low = key[1] > key[0] ? 1 : 0;
    const std::size_t high = key[3] > key[2] ? 3 : 2;
    const std::size_t largest = key[high] > key[low] ? high : low;
    if (key[largest] < 0) return false;
    if (turn[largest] != 0) return turn[largest] > 0;
    key[largest] = -HUGE_VAL;
  }
}

}  // namespace terrace::tri::spatial
