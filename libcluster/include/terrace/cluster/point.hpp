// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

/// Points and boxes, in a Cartesian frame and a unit chosen by the caller.

namespace terrace::cluster {

/// A standard type, so that it is the same in every library of the workspace.
using Point3 = std::array<double, 3>;

/// A closed axis-aligned box; min = +infinity and max = -infinity when empty.
struct Bounds {
  Point3 min, max;
  friend bool operator==(const Bounds&, const Bounds&) = default;
};

inline constexpr Bounds kEmptyBounds{
    {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
     std::numeric_limits<double>::infinity()},
    {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
     -std::numeric_limits<double>::infinity()}};

/// The smallest box that contains all the points.
[[nodiscard]] inline Bounds bounds_of(std::span<const Point3> points) {
  Bounds box = kEmptyBounds;
  for (const Point3& p : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Not std::min(), whose references keep the box in memory.
      box.min[axis] = p[axis] < box.min[axis] ? p[axis] : box.min[axis];
      box.max[axis] = p[axis] > box.max[axis] ? p[axis] : box.max[axis];
    }
  }
  return box;
}

[[nodiscard]] inline bool contains(const Bounds& box, const Point3& p) {
  return box.min[0] <= p[0] && p[0] <= box.max[0] && box.min[1] <= p[1] && p[1] <= box.max[1] &&
         box.min[2] <= p[2] && p[2] <= box.max[2];
}

}  // namespace terrace::cluster
