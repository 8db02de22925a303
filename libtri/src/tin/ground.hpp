// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

/// Exact predicates on a lattice, in the metric of the ground.

namespace terrace::tri::tin {

/// Twice the area: > 0 if a, b, c turn left (columns to the right, rows upwards).
template <class P>
std::int64_t turn(const P& a, const P& b, const P& c) {
  return static_cast<std::int64_t>(b.x - a.x) * (c.y - a.y) -
         static_cast<std::int64_t>(b.y - a.y) * (c.x - a.x);
}

/// Calls visit(y, first x, last x) for each row of a counter-clockwise triangle, including sides,
/// until it returns false.
template <class P, class Visit>
bool visit_rows(const P& a, const P& b, const P& c, const Visit& visit) {
  const auto floor_divide = [](std::int64_t n, std::int64_t d) {
    return n / d - (n % d < 0 ? 1 : 0);
  };
  const P* const corner[4] = {&a, &b, &c, &a};
  const std::int32_t top = std::min({a.y, b.y, c.y}), bottom = std::max({a.y, b.y, c.y});
  for (std::int32_t y = top; y <= bottom; ++y) {
    std::int64_t first = std::min({a.x, b.x, c.x}), last = std::max({a.x, b.x, c.x});
    for (int i = 0; i < 3; ++i) {
      const P &p = *corner[i], &q = *corner[i + 1];
      // A sample is left of pq if along_x (x - p.x) + along_y (y - p.y) >= 0.
      const std::int64_t along_x = p.y - q.y, along_y = q.x - p.x;
      const std::int64_t offset = along_y * (y - p.y);
      if (along_x > 0) first = std::max(first, p.x - floor_divide(offset, along_x));
      if (along_x < 0) last = std::min(last, p.x + floor_divide(offset, -along_x));
    }
    if (first <= last &&
        !visit(y, static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)))
      return false;
  }
  return true;
}

/// The tangent of an angle of at most 30 degrees, to 1e-9. Uses the first terms of the series,
/// because results must not depend on a library's tangent.
inline double tangent_of(double degrees) {
  constexpr double kRadians = 0.017453292519943295;
  const double a = degrees * kRadians;
  const double s = a * a;
  const double sine = a * (1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72))));
  const double cosine = 1 - s / 2 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56)));
  return sine / cosine;
}

class Ground {
 public:
  /// column_step, row_step: on the ground. extent: the greatest difference of coordinates. tangent:
  /// tangent of the smallest angle for which has_wide_angles() is true.
  Ground(double column_step, double row_step, std::int64_t extent, double tangent)
      : tangent_(tangent) {
    const double x = std::fabs(column_step), y = std::fabs(row_step);
    const double ratio = std::min(x, y) / std::max(x, y);
    const auto smaller = std::max<std::int64_t>(1, std::llround(1024 * ratio * ratio));
    const std::int64_t common = std::gcd(smaller, std::int64_t{1024});
    x_ = (x < y ? smaller : 1024) / common;
    y_ = (x < y ? 1024 : smaller) / common;
    area_ = std::sqrt(static_cast<double>(x_) * static_cast<double>(y_));
    const auto size = static_cast<double>(extent);
    narrow_ = 6 * static_cast<double>(x_ + y_) * size * size * size * size < 0x1p62;
  }

  /// True if p is strictly inside the circle through the counter-clockwise a, b, c.
  template <class P>
  bool in_circle(const P& a, const P& b, const P& c, const P& p) const {
    return narrow_ ? in_circle_with<std::int64_t>(a, b, c, p) : in_circle_with<Int128>(a, b, c, p);
  }

  /// True if the counter-clockwise a, b, c, of twice the area `twice` on the lattice, have no angle
  /// below the smallest one.
  template <class P>
  bool has_wide_angles(const P& a, const P& b, const P& c, std::int64_t twice) const {
    const std::int64_t ab = square(a, b), bc = square(b, c), ca = square(c, a);
    // Twice the scalar product at the smallest angle, which is opposite to the shortest side.
    const std::int64_t twice_product = ab + bc + ca - 2 * std::min({ab, bc, ca});
    return 2 * area_ * static_cast<double>(twice) >= tangent_ * static_cast<double>(twice_product);
  }

  template <class P>
  std::int64_t square(const P& a, const P& b) const {
    const std::int64_t x = b.x - a.x, y = b.y - a.y;
    return x_ * x * x + y_ * y * y;
  }

 private:
  __extension__ typedef __int128 Int128;

  template <class Wide, class P>
  bool in_circle_with(const P& a, const P& b, const P& c, const P& p) const {
    const std::int64_t ax = a.x - p.x, ay = a.y - p.y;
    const std::int64_t bx = b.x - p.x, by = b.y - p.y;
    const std::int64_t cx = c.x - p.x, cy = c.y - p.y;
    const std::int64_t aa = x_ * ax * ax + y_ * ay * ay;
    const std::int64_t bb = x_ * bx * bx + y_ * by * by;
    const std::int64_t cc = x_ * cx * cx + y_ * cy * cy;
    return Wide{bx * cy - by * cx} * aa + Wide{cx * ay - cy * ax} * bb +
               Wide{ax * by - ay * bx} * cc >
           0;
  }

  std::int64_t x_, y_;  ///< squares of the steps, up to a common factor
  double area_;         ///< area of a cell, in the unit of the squares
  double tangent_;
  bool narrow_;  ///< true if 64 bits suffice
};

}  // namespace terrace::tri::tin
