// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "int_kernel.hpp"
#include "terrace/tri/delaunay2.hpp"

/// Exact predicates of the metric Windowed, which lifts a point to C g(x, y) + x^2 + y^2 with C
/// infinitely large and g(x, y) = h(x) + h(y).
///
/// Let S be the side of a window. h interpolates t^2 linearly between the multiples of S. A linear
/// function added to a lift changes no triangle, and neither does a positive factor. So h can be
/// replaced by the integral of floor(t / S), where t may be relative to any multiple of S.

namespace terrace::tri::planar {

struct WindowedKernel : IntKernel {
  /// > 0 if p is inside the "circle" through the counter-clockwise a, b, c, that is, if the lifted
  /// p is below the plane through the lifted a, b, c; 0 if it is on the plane.
  ///
  /// The determinant that decides is linear in the lift. As C is infinite, the sign is that of the
  /// determinant of g, or, if this is 0, that of the determinant of x^2 + y^2. If both are 0, the
  /// points are cocircular, and the perturbation of predicates.hpp, which raises lifted points,
  /// decides as in the Euclidean metric.
  [[gnu::noinline]] static int in_circle(Point a, Point b, Point c, Point p) {
    const auto different_bits = [&](std::size_t k) {
      return (a[k] ^ b[k]) | (a[k] ^ c[k]) | (a[k] ^ p[k]);
    };
    const Coord bits = different_bits(0) | different_bits(1);
    // Otherwise all four are in one window, where g is linear, so that its determinant is 0.
    if (bits >= Windowed::kCells) {
      const int order = below_plane(a, b, c, p, bits < kNear);
      if (order != 0) return order;
    }
    return IntKernel::in_circle(a, b, c, p);
  }

 private:
  static constexpr unsigned kBits = Windowed::kBits;
  static_assert(kBits >= 6 && kBits <= 16, "the bounds of below_plane() require it");
  static constexpr Coord kNear = 1 << 16;

  /// The integral of floor(s / S) for s from 0 to t. From 0 to (t - S/2)^2 / (2 S), and 0 in the
  /// window [0, S].
  static std::int64_t lift(std::int64_t t) {
    const std::int64_t window = t >> kBits;
    return window * t - window * (window + 1) / 2 * Windowed::kCells;
  }

  /// in_circle() for the lift g alone. `near`: coordinates differ by less than kNear.
  ///
  /// Relative to the window of a, whose lift is then 0, |t - S/2| is at most the difference D of
  /// two points plus S/2. So a lift is at most (D + S/2)^2 / S, and a cross product 2 D^2. With D <
  /// 2^16 and S >= 2^6 this is below 2^27 and 2^33, and the sum of three products below 2^62. With
  /// D < 2^30 it is below 2^55, 2^61 and 2^118.
  static int below_plane(Point a, Point b, Point c, Point p, bool near) {
    const auto g = [origin_x = a[0] >> kBits << kBits, origin_y = a[1] >> kBits << kBits](Point q) {
      return lift(q[0] - origin_x) + lift(q[1] - origin_y);
    };
    const std::int64_t at_b = g(b), at_c = g(c), at_p = g(p);
    const std::int64_t pc = angle(a, p, c).cross, bp = angle(a, b, p).cross,
                       bc = angle(a, b, c).cross;
    // The height of the plane above the lifted p, times bc, which is positive.
    if (near) return sign(at_b * pc + at_c * bp - at_p * bc);
    const Int128 height = static_cast<Int128>(at_b) * pc + static_cast<Int128>(at_c) * bp -
                          static_cast<Int128>(at_p) * bc;
    return (height > 0) - (height < 0);
  }
};

}  // namespace terrace::tri::planar
