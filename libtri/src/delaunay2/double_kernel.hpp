// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

/// Exact predicates on doubles. One evaluation in double with an error bound nearly always decides.
/// The remaining cases use integers if the coordinates are integers, otherwise CGAL.

namespace terrace::tri::planar {

struct DoubleKernel {
  using Coord = double;
  using Point = std::array<Coord, 2>;

  static bool valid(const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); }

  struct Angle {
    double cross;
    double dot;
  };
  /// Rounded, for a first choice. Exact predicates make the final decision.
  static Angle angle(const Point& apex, const Point& b, const Point& c) {
    const double bx = b[0] - apex[0];
    const double by = b[1] - apex[1];
    const double cx = c[0] - apex[0];
    const double cy = c[1] - apex[1];
    return {bx * cy - by * cx, bx * cx + by * cy};
  }

  /// > 0 if a, b, c turn left, 0 if they are collinear.
  static int orientation(const Point& a, const Point& b, const Point& c) {
    const double left = (b[0] - a[0]) * (c[1] - a[1]);
    const double right = (b[1] - a[1]) * (c[0] - a[0]);
    const double cross = left - right;
    // (3 + 16 u) u of J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust
    // geometric predicates", doi:10.1007/PL00009321, rounded up. The last term covers products
    // that underflow.
    const double bound = 0x1.9p-52 * (std::abs(left) + std::abs(right)) + 0x1p-1000;
    // This is false for infinities and NaN, which result from overflow.
    if (std::abs(cross) > bound && bound < 0x1p1000) return cross > 0 ? 1 : -1;
    return orientation_exact(a, b, c);
  }

  /// > 0 if p is inside the circle through the counter-clockwise a, b, c, or 0 if on it. Uses the
  /// same formula as IntKernel::in_circle().
  static int in_circle(const Point& a, const Point& b, const Point& c, const Point& p) {
    const BoundedAngle at_a = bounded_angle(a, b, c);
    const BoundedAngle at_p = bounded_angle(p, c, b);
    const double sine = at_a.cross * at_p.dot + at_p.cross * at_a.dot;
    // Each term is a product of two rounded sums of two products of differences. Relative errors of
    // u = 2^-53 come from the differences (2 + 2), products (1 + 1), sums (1 + 1), the product and
    // the last sum: 10 u of the sum of absolute values. That sum is itself rounded, so 12 u is
    // safe. Sizes below 2^-200 or above 2^200 (close to underflow or overflow) are left to the
    // exact test.
    const double size = at_a.cross_size * at_p.dot_size + at_p.cross_size * at_a.dot_size;
    const double largest = at_a.dot_size + at_p.dot_size + at_a.cross_size + at_p.cross_size;
    if (std::abs(sine) > 12 * 0x1p-53 * size + 0x1p-400 && largest < 0x1p200)
      return sine < 0 ? 1 : -1;
    return in_circle_exact(a, b, c, p);
  }

  /// < 0 if a is nearer to p than b.
  static int compare_distance(const Point& p, const Point& a, const Point& b);

 private:
  struct BoundedAngle {
    double cross;
    double dot;
    double cross_size;  ///< sums of absolute values of the products
    double dot_size;
  };
  static BoundedAngle bounded_angle(const Point& apex, const Point& b, const Point& c) {
    const double bx = b[0] - apex[0];
    const double by = b[1] - apex[1];
    const double cx = c[0] - apex[0];
    const double cy = c[1] - apex[1];
    const double xy = bx * cy;
    const double yx = by * cx;
    const double xx = bx * cx;
    const double yy = by * cy;
    return {xy - yx, xx + yy, std::abs(xy) + std::abs(yx), std::abs(xx) + std::abs(yy)};
  }
  static int orientation_exact(const Point& a, const Point& b, const Point& c);
  static int in_circle_exact(const Point& a, const Point& b, const Point& c, const Point& p);
};

}  // namespace terrace::tri::planar
