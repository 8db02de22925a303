// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace terrace::stream {

/// A point in the frame that its owner documents. A standard type, so that it is the same type in
/// every library of the workspace.
using Point3 = std::array<double, 3>;

/// An axis-aligned box, closed on all sides: a point on the border is inside. The default box is
/// empty (min > max) and grows by `include`.
struct Box3 {
  Point3 min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity()};
  Point3 max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
             -std::numeric_limits<double>::infinity()};

  /// True when no point is inside.
  [[nodiscard]] bool empty() const {
    return !(min[0] <= max[0] && min[1] <= max[1] && min[2] <= max[2]);
  }
  /// Extends the box to hold `p`. NaN coordinates leave it unchanged.
  void include(const Point3& p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (p[axis] < min[axis]) min[axis] = p[axis];
      if (p[axis] > max[axis]) max[axis] = p[axis];
    }
  }
  /// Extends the box to hold `other`; an empty box changes nothing.
  void include(const Box3& other) {
    if (other.empty()) return;
    include(other.min);
    include(other.max);
  }
  [[nodiscard]] bool contains(const Point3& p) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(p[axis] >= min[axis] && p[axis] <= max[axis])) return false;
    }
    return true;
  }
  [[nodiscard]] bool intersects(const Box3& other) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(min[axis] <= other.max[axis] && max[axis] >= other.min[axis])) return false;
    }
    return true;
  }

  friend bool operator==(const Box3&, const Box3&) = default;
};

}  // namespace terrace::stream
