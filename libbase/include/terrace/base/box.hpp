// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

/// Points and axis-aligned boxes, in a Cartesian frame and a unit chosen by the caller.

namespace terrace::base {

/// Standard types, so that points have the same type in every library.
using Point2 = std::array<double, 2>;
using Point3 = std::array<double, 3>;

/// An axis-aligned box, closed on all sides: a point on the border is inside. The default box is
/// empty (min = +infinity, max = -infinity; for integers, the largest and the smallest) and grows
/// by include().
template <std::size_t D, class T = double>
struct Box {
  using Point = std::array<T, D>;

  Point min = filled(kLargest);
  Point max = filled(kSmallest);

  /// Returns whether the box contains no point: on some axis min > max, or a bound is NaN.
  [[nodiscard]] constexpr bool empty() const {
    for (std::size_t axis = 0; axis < D; ++axis) {
      if (!(min[axis] <= max[axis])) return true;
    }
    return false;
  }
  /// Extends the box to contain `p`. NaN coordinates leave it unchanged.
  constexpr void include(const Point& p) {
    for (std::size_t axis = 0; axis < D; ++axis) {
      // Not std::min(), whose references keep the box in memory.
      min[axis] = p[axis] < min[axis] ? p[axis] : min[axis];
      max[axis] = p[axis] > max[axis] ? p[axis] : max[axis];
    }
  }
  /// Extends the box to contain `other`; an empty box changes nothing.
  constexpr void include(const Box& other) {
    if (other.empty()) return;
    include(other.min);
    include(other.max);
  }
  [[nodiscard]] constexpr bool contains(const Point& p) const {
    for (std::size_t axis = 0; axis < D; ++axis) {
      if (!(min[axis] <= p[axis] && p[axis] <= max[axis])) return false;
    }
    return true;
  }
  /// Returns whether `other` is entirely inside this box; false if a bound is NaN.
  [[nodiscard]] constexpr bool covers(const Box& other) const {
    for (std::size_t axis = 0; axis < D; ++axis) {
      if (!(min[axis] <= other.min[axis] && other.max[axis] <= max[axis])) return false;
    }
    return true;
  }
  /// Returns whether the boxes have a point in common; false if a bound is NaN.
  [[nodiscard]] constexpr bool intersects(const Box& other) const {
    for (std::size_t axis = 0; axis < D; ++axis) {
      if (!(min[axis] <= other.max[axis] && other.min[axis] <= max[axis])) return false;
    }
    return true;
  }
  /// The box with each side moved outward by `by`.
  [[nodiscard]] constexpr Box widened(T by) const {
    Box box = *this;
    for (std::size_t axis = 0; axis < D; ++axis) {
      box.min[axis] -= by;
      box.max[axis] += by;
    }
    return box;
  }
  /// The squared distance from `p` to the nearest point of the box, 0 inside. The box must not be
  /// empty. Rounding does not raise it above the squared distance from `p` to a point of the box,
  /// if that is the sum of the squared differences in the order of the axes.
  [[nodiscard]] constexpr T squared_distance(const Point& p) const {
    T sum = 0;
    for (std::size_t axis = 0; axis < D; ++axis) {
      const T outside = std::max({min[axis] - p[axis], p[axis] - max[axis], T{0}});
      sum += outside * outside;
    }
    return sum;
  }
  /// The squared distance between the nearest points of two boxes, 0 if they intersect. Neither may
  /// be empty. The bound on rounding is that of squared_distance() of a point.
  [[nodiscard]] constexpr T squared_distance(const Box& other) const {
    T sum = 0;
    for (std::size_t axis = 0; axis < D; ++axis) {
      const T outside = std::max({min[axis] - other.max[axis], other.min[axis] - max[axis], T{0}});
      sum += outside * outside;
    }
    return sum;
  }

  friend constexpr bool operator==(const Box&, const Box&) = default;

 private:
  using Limits = std::numeric_limits<T>;
  static constexpr T kLargest = Limits::has_infinity ? Limits::infinity() : Limits::max();
  static constexpr T kSmallest = Limits::has_infinity ? -Limits::infinity() : Limits::lowest();

  static constexpr Point filled(T value) {
    Point point{};
    point.fill(value);
    return point;
  }
};

using Box2 = Box<2>;
using Box3 = Box<3>;

/// Returns the smallest box that contains all points; an empty box if there are none.
[[nodiscard]] constexpr Box2 box_of(std::span<const Point2> points) {
  Box2 box;
  for (const Point2& p : points) box.include(p);
  return box;
}
[[nodiscard]] constexpr Box3 box_of(std::span<const Point3> points) {
  Box3 box;
  for (const Point3& p : points) box.include(p);
  return box;
}

}  // namespace terrace::base
