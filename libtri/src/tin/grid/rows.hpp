// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "scan.hpp"

namespace terrace::tri::tin {

inline std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

/// Calls visit(y, first x, last x) for the rows of samples in a counter-clockwise triangle, its
/// sides included, until that returns false. Integers only.
template <class T, class Visit>
bool visit_rows(const GridCorner<T>& a, const GridCorner<T>& b, const GridCorner<T>& c,
                const Visit& visit) {
  const GridCorner<T>* const corner[4] = {&a, &b, &c, &a};
  const std::int32_t top = std::min({a.y, b.y, c.y}), bottom = std::max({a.y, b.y, c.y});
  for (std::int32_t y = top; y <= bottom; ++y) {
    std::int64_t first = std::min({a.x, b.x, c.x}), last = std::max({a.x, b.x, c.x});
    for (int i = 0; i < 3; ++i) {
      const GridCorner<T>&p = *corner[i], &q = *corner[i + 1];
      // Left of pq: along_x (x - p.x) + along_y (y - p.y) >= 0.
      const std::int64_t along_x = p.y - q.y, along_y = q.x - p.x;
      const std::int64_t rest = along_y * (y - p.y);
      if (along_x > 0) first = std::max(first, p.x - floor_divide(rest, along_x));
      if (along_x < 0) last = std::min(last, p.x + floor_divide(rest, -along_x));
    }
    if (first <= last &&
        !visit(y, static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)))
      return false;
  }
  return true;
}

}  // namespace terrace::tri::tin
