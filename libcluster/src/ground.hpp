// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "terrace/cluster/hierarchy.hpp"
#include "terrace/cluster/point.hpp"

/// Arithmetic on positions, boxes and ground maps. Private to the hierarchy.

namespace terrace::cluster {

inline Point3 difference(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Point3 mapped(const GroundMap& m, const Point3& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}

/// Returns whether the map keeps axes separate. For finite values mapped() then only multiplies by
/// the diagonal, up to the signs of zeros.
inline bool is_diagonal(const GroundMap& m) {
  return m[1] == 0.0 && m[2] == 0.0 && m[3] == 0.0 && m[5] == 0.0 && m[6] == 0.0 && m[7] == 0.0;
}

inline double squared_length(const Point3& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// Returns the sum of the ground extents of a box, with the absolute values of the map's entries.
/// No vector between two points of the box is longer on the ground, and nothing is squared.
inline double ground_extent(const GroundMap& m, const Box3& box) {
  const Point3 size = difference(box.max, box.min);
  double sum = 0.0;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) sum += std::abs(m[3 * row + axis]) * size[axis];
  }
  return sum;
}

/// Returns the index of the first point with a coordinate that is not finite, or positions.size().
std::size_t first_not_finite(std::span<const Point3> positions);

/// Throws std::invalid_argument if the map is not finite or zero, or if ground distances within the
/// box are beyond 1e150, so that their squares would overflow. The message names the block.
void check_ground_map(const GroundMap& map, const Box3& box, unsigned level, std::uint64_t block);

/// Sets out[i] = map * (positions[i] - origin).
void to_ground(std::span<const Point3> positions, const Point3& origin, const GroundMap& map,
               std::span<Point3> out);

}  // namespace terrace::cluster
