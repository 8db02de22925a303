// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

/// Predicates on the lattice with the distances that it has on the ground, exact.

namespace terrace::tri::tin {

/// Twice the area: > 0 where a, b, c turn left (columns to the right, rows upwards).
template <class P>
std::int64_t turn(const P& a, const P& b, const P& c) {
  return static_cast<std::int64_t>(b.x - a.x) * (c.y - a.y) -
         static_cast<std::int64_t>(b.y - a.y) * (c.x - a.x);
}

class Ground {
 public:
  /// Steps on the ground of a column and a row; `extent`: the greatest difference of coordinates.
  Ground(double column_step, double row_step, std::int64_t extent) {
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

  /// Whether p lies strictly in the circle through the counter-clockwise a, b, c.
  template <class P>
  bool in_circle(const P& a, const P& b, const P& c, const P& p) const {
    return narrow_ ? in_circle_with<std::int64_t>(a, b, c, p) : in_circle_with<Int128>(a, b, c, p);
  }

  /// Whether the counter-clockwise a, b, c, of twice the area `twice` on the lattice, have no angle
  /// of less than 5 degrees.
  template <class P>
  bool wide(const P& a, const P& b, const P& c, std::int64_t twice) const {
    const std::int64_t ab = square(a, b), bc = square(b, c), ca = square(c, a);
    // The greatest scalar product of two sides is the one opposite to the shortest side.
    const std::int64_t most = ab + bc + ca - 2 * std::min({ab, bc, ca});
    constexpr double kTangent = 0.08748866352592401;  // of 5 degrees
    return 2 * area_ * static_cast<double>(twice) >= kTangent * static_cast<double>(most);
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

  std::int64_t x_, y_;  ///< squares of the steps, in proportion
  double area_;         ///< of a cell, in the same unit
  bool narrow_;         ///< 64 bits suffice
};

}  // namespace terrace::tri::tin
