// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrace::cluster {

/// Returns the root mean square of the distances between corresponding corners of two entities,
/// under the best correspondence that the entities admit. square(i, j) is the squared distance of
/// corner i of one from corner j of the other. The result is symmetric to the last bit.
/// ordered: vertices keep their order (polylines), so the correspondences are forward and backward.
/// Otherwise every correspondence is allowed, for at most three corners.
template <class Square>
double corner_distance(std::size_t corners, bool ordered, const Square& square) {
  assert(corners > 0 && (ordered || corners <= 3));
  double least = 0.0;
  if (corners == 3 && !ordered) {
    std::array<std::array<double, 3>, 3> squares{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) squares[i][j] = square(i, j);
    }
    least = std::numeric_limits<double>::infinity();
    for (std::size_t first = 0; first < 3; ++first) {
      for (const std::size_t step : {std::size_t{1}, std::size_t{2}}) {
        const double a = squares[0][first];
        const double b = squares[1][(first + step) % 3];
        const double c = squares[2][(first + 2 * step) % 3];
        // Added in ascending order, because the terms come in a different order for the other
        // entity.
        const double low = std::min(a, b), high = std::max(a, b);
        const double sum =
            (std::min(low, c) + std::max(low, std::min(high, c))) + std::max(high, c);
        least = std::min(least, sum);
      }
    }
  } else {
    // Adds both ends together, because for the other entity "backward" starts from the other end.
    double forward = 0.0, backward = 0.0;
    for (std::size_t i = 0, j = corners - 1; i <= j; ++i, --j) {
      forward += i == j ? square(i, i) : square(i, i) + square(j, j);
      backward += i == j ? square(i, i) : square(i, j) + square(j, i);
      if (j == 0) break;
    }
    least = std::min(forward, backward);
  }
  return std::sqrt(least / static_cast<double>(corners));
}

}  // namespace terrace::cluster
