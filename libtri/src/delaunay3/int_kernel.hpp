// SPDX-License-Identifier: Apache-2.0
#pragma once

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <array>
#include <cstdint>
#include <cstring>

#include "in_sphere.hpp"

/// Exact predicates on 30-bit integers. Orientation uses integers only. The sphere test uses a
/// filter in double, where differences of such integers are exact, and then 192-bit integers.

namespace terrace::tri::spatial {

__extension__ typedef __int128 Int128;
__extension__ typedef unsigned __int128 UInt128;

struct IntKernel {
  using Coord = std::int32_t;
  using Point = std::array<Coord, 3>;
  static constexpr Coord kLimit = Coord{1} << 30;  ///< coordinates are in [0, kLimit)

  struct alignas(16) Vertex {
    Point point;
    std::uint32_t incident;  ///< see mesh.hpp
  };

  static bool valid(const Point& p) {
    for (const Coord c : p)
      if (static_cast<std::uint32_t>(c) >= static_cast<std::uint32_t>(kLimit)) return false;
    return true;
  }

  /// The sign of det(b - a, c - a, d - a): > 0 if the four are in order, 0 if coplanar.
  static int orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
    const Vector u = difference(b, a);
    const Vector v = difference(c, a);
    const Vector w = difference(d, a);
    const Int128 det = Int128{u.y * v.z - u.z * v.y} * w.x + Int128{u.z * v.x - u.x * v.z} * w.y +
                       Int128{u.x * v.y - u.y * v.x} * w.z;
    return (det > 0) - (det < 0);
  }
  /// True if a, b, c are collinear.
  static bool collinear(const Point& a, const Point& b, const Point& c) {
    const Vector u = difference(b, a);
    const Vector v = difference(c, a);
    return u.y * v.z == u.z * v.y && u.z * v.x == u.x * v.z && u.x * v.y == u.y * v.x;
  }

  /// The property that all points of a mesh share. Integers need none.
  struct Lattice {
    static void add(const Point&) {}
  };

  /// A point that is tested against many spheres.
  class Probe {
   public:
    Probe(const Point& p, Lattice) : at_{p[0], p[1], p[2], 0} {}

    /// The position of the point relative to the sphere through four vertices in order, after the
    /// perturbation.
    [[gnu::always_inline]] Verdict side(const Vertex& a, const Vertex& b, const Vertex& c,
                                        const Vertex& d) const {
      const Lanes ra = load(a) - at_, rb = load(b) - at_, rc = load(c) - at_, rd = load(d) - at_;
      const Lanes xy01 = __builtin_shufflevector(ra, rb, 0, 4, 1, 5);
      const Lanes xy23 = __builtin_shufflevector(rc, rd, 0, 4, 1, 5);
      const Lanes z01 = __builtin_shufflevector(ra, rb, 2, 6, 3, 7);
      const Lanes z23 = __builtin_shufflevector(rc, rd, 2, 6, 3, 7);
      const Rows rows = {low(xy01), low(xy23), high(xy01), high(xy23), low(z01), low(z23)};
      const InSphere test = in_sphere_value(rows);
      // Let L be the largest squared length of a row. A 2 x 2 minor is at most L in absolute value,
      // summed over its products, a 3 x 3 minor 3 L^1.5, the value 12 L^2.5. Relative errors of u =
      // 2^-53: 2 in a minor, 3 more in the next one, 3 in a square, 1 in the product, 2 in the
      // sums. The total is 11 * 12 u < 1.5e-14.
      const double fifth = test.largest * test.largest * test.largest * test.largest * test.largest;
      if (!(test.value * test.value > 2.25e-28 * fifth)) [[unlikely]] {
        if (!(fifth < kExactFifth)) return Verdict::open;
        if (test.value == 0)
          return inside_small_perturbed_sphere(rows) ? Verdict::in : Verdict::out;
      }
      return test.value > 0 ? Verdict::in : Verdict::out;
    }

   private:
    using Lanes = std::int32_t __attribute__((vector_size(16)));
#ifndef __SSE2__
    using Half = std::int32_t __attribute__((vector_size(8)));
#endif
    static Lanes load(const Vertex& v) {
      Lanes lanes;
      std::memcpy(&lanes, &v, sizeof lanes);
      return lanes;
    }
#ifdef __SSE2__
    // When GCC 12 must respect rounding modes it converts lane by lane, though rounding does not
    // matter here.
    static Pair low(Lanes v) { return _mm_cvtepi32_pd(reinterpret_cast<__m128i>(v)); }
#else
    static Pair low(Lanes v) {
      const Half half = __builtin_shufflevector(v, v, 0, 1);
      return __builtin_convertvector(half, Pair);
    }
#endif
    static Pair high(Lanes v) { return low(__builtin_shufflevector(v, v, 2, 3, 2, 3)); }
    Lanes at_;
  };

  /// > 0 if p is inside the sphere through a, b, c, d, which are in order, or 0 if on it.
  [[gnu::noinline]] static int in_sphere(const Point& a, const Point& b, const Point& c,
                                         const Point& d, const Point& p) {
    const std::array<Vector, 4> r = {difference(a, p), difference(b, p), difference(c, p),
                                     difference(d, p)};
    // The sum of 3 x 3 minors (93 bits) times squares (62 bits), in two limbs.
    Int128 high = 0;
    Int128 low = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector& e = r[(i + 1) & 3];
      const Vector& f = r[(i + 2) & 3];
      const Vector& g = r[(i + 3) & 3];
      const Int128 minor = Int128{e.x * f.y - e.y * f.x} * g.z +
                           Int128{f.x * g.y - f.y * g.x} * e.z +
                           Int128{g.x * e.y - g.y * e.x} * f.z;
      const Int128 square = r[i].x * r[i].x + r[i].y * r[i].y + r[i].z * r[i].z;
      const Int128 upper = (minor >> 64) * square;
      const Int128 lower = Int128{static_cast<std::uint64_t>(minor)} * square;
      high += i % 2 == 0 ? upper : -upper;
      low += i % 2 == 0 ? lower : -lower;
    }
    high += low >> 64;
    if (high != 0) return high > 0 ? 1 : -1;
    return static_cast<std::uint64_t>(low) != 0 ? 1 : 0;
  }

  /// < 0 if a is nearer to p than b.
  static int compare_distance(const Point& p, const Point& a, const Point& b) {
    const auto square = [&p](const Point& q) {
      const Vector v = difference(q, p);
      return v.x * v.x + v.y * v.y + v.z * v.z;
    };
    const std::int64_t order = square(a) - square(b);
    return (order > 0) - (order < 0);
  }

 private:
  struct Vector {
    std::int64_t x, y, z;
  };
  static Vector difference(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }
};

}  // namespace terrace::tri::spatial
