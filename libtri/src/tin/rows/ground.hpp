// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Predicates of vertices at whole places below 2^20, exact.

namespace terrace::tri::tin::rows {

/// > 0: a, b, c turn left; exact.
template <class P>
std::int64_t turn(const P& a, const P& b, const P& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

/// Whether p lies strictly in the circle through the counter-clockwise a, b, c.
template <class P>
bool in_circle(const P& a, const P& b, const P& c, const P& p) {
  __extension__ typedef __int128 Wide;
  const std::int64_t ax = a.x - p.x, ay = a.y - p.y;
  const std::int64_t bx = b.x - p.x, by = b.y - p.y;
  const std::int64_t cx = c.x - p.x, cy = c.y - p.y;
  return Wide{bx * cy - by * cx} * (ax * ax + ay * ay) +
             Wide{cx * ay - cy * ax} * (bx * bx + by * by) +
             Wide{ax * by - ay * bx} * (cx * cx + cy * cy) >
         0;
}

}  // namespace terrace::tri::tin::rows
