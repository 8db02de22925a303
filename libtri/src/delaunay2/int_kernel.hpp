// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

/// Exact predicates on 30-bit integers, without floating point and filters. Differences have 31
/// bits with sign, their products fit into 64 bits, and the products of those into 128.

namespace terrace::tri::planar {

__extension__ typedef __int128 Int128;

struct IntKernel {
  using Coord = std::int32_t;
  using Point = std::array<Coord, 2>;
  static constexpr Coord kLimit = Coord{1} << 30;  ///< coordinates are in [0, kLimit)

  static bool valid(const Point& p) {
    return static_cast<std::uint32_t>(p[0]) < static_cast<std::uint32_t>(kLimit) &&
           static_cast<std::uint32_t>(p[1]) < static_cast<std::uint32_t>(kLimit);
  }

  /// Cross and dot product of the vectors from `apex` to b and c.
  struct Angle {
    std::int64_t cross;
    std::int64_t dot;
  };
  static Angle angle(Point apex, Point b, Point c) {
    const std::int64_t bx = b[0] - apex[0];
    const std::int64_t by = b[1] - apex[1];
    const std::int64_t cx = c[0] - apex[0];
    const std::int64_t cy = c[1] - apex[1];
    return {bx * cy - by * cx, bx * cx + by * cy};
  }

  /// > 0 if a, b, c turn left, 0 if they are collinear.
  static int orientation(Point a, Point b, Point c) { return sign(angle(a, b, c).cross); }

  /// > 0 if p is inside the circle through the counter-clockwise a, b, c, or 0 if on it.
  ///
  /// p is inside if the angles at a and at p over the chord bc add up to more than 180 degrees.
  /// That is the sign of sin(A + P), which takes 10 multiplications of short numbers. Deliberately
  /// not inlined: inlining takes registers from its callers and is slower.
  [[gnu::noinline]] static int in_circle(Point a, Point b, Point c, Point p) {
    const Angle at_a = angle(a, b, c);
    const Angle at_p = angle(p, c, b);
    // 64 bits suffice for nearby points. WebAssembly has no wider products.
    const auto raised = [](std::int64_t value) {
      return static_cast<std::uint64_t>(value + kNear);
    };
    const std::uint64_t all =
        raised(at_a.cross) | raised(at_a.dot) | raised(at_p.cross) | raised(at_p.dot);
    if (all < 2 * kNear) [[likely]] {
      return -sign(at_a.cross * at_p.dot + at_p.cross * at_a.dot);
    }
    const Int128 sine =
        static_cast<Int128>(at_a.cross) * at_p.dot + static_cast<Int128>(at_p.cross) * at_a.dot;
    return (sine < 0) - (sine > 0);
  }

  /// < 0 if a is nearer to p than b.
  static int compare_distance(Point p, Point a, Point b) {
    const auto square = [p](Point q) {
      const std::int64_t x = q[0] - p[0];
      const std::int64_t y = q[1] - p[1];
      return x * x + y * y;
    };
    return sign(square(a) - square(b));
  }

 protected:
  static int sign(std::int64_t value) { return (value > 0) - (value < 0); }

 private:
  static constexpr std::int64_t kNear = std::int64_t{1} << 30;
};

}  // namespace terrace::tri::planar
