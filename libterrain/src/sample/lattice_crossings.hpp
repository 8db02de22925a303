// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Calls visit(t, place) at each point, 0 < t < 1, where the segment between two places of a
/// raster's lattice crosses a column, a row or a diagonal, in order. The linear surface is straight
/// between these points. Each place is on its line to the last bit.
template <class Visit>
void for_lattice_crossings(const Point2& from, const Point2& to, const Visit& visit) {
  // Columns, rows, and the diagonals, on which the sum of column and row is an integer.
  const std::array<double, 3> begin{from[0], from[1], from[0] + from[1]};
  const std::array<double, 3> end{to[0], to[1], to[0] + to[1]};
  std::array<double, 3> next{}, at{};
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const auto t_of = [&](std::size_t k) {
    const double t = (next[k] - begin[k]) / (end[k] - begin[k]);
    return t < 1 ? t : kNever;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    if (begin[k] == end[k]) {
      at[k] = kNever;
      continue;
    }
    next[k] = begin[k] < end[k] ? std::floor(begin[k]) + 1 : std::ceil(begin[k]) - 1;
    at[k] = t_of(k);
  }
  double last = 0;
  while (true) {
    const double t = *std::min_element(at.begin(), at.end());
    if (t == kNever) return;
    Point2 place{from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])};
    for (std::size_t k = 0; k < 3; ++k) {
      if (at[k] > t) continue;
      if (k < 2) place[k] = next[k];
      next[k] += begin[k] < end[k] ? 1 : -1;
      at[k] = t_of(k);
    }
    // Rounding may separate crossings where lines of the lattice meet; one row is enough.
    if (t - last <= 1e-12 && last > 0) continue;
    visit(t, place);
    last = t;
  }
}

}  // namespace terrace::terrain
