// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a scan knows of its triangle before it looks at samples. The rules of grid_scan_impl.hpp
// hold here.
#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

template <class V>
[[gnu::always_inline]] inline V least(V a, V b) {
  return b < a ? b : a;
}
template <class V>
[[gnu::always_inline]] inline V greatest(V a, V b) {
  return b > a ? b : a;
}

/// The triangle's plane relative to its first corner, the box of the samples to look at, and what
/// rounding may do to an error. The samples are those of every kStep-th column and row; the box
/// counts them, corners have columns and rows.
template <class T, int kStep>
struct Plane {
  using Real = T;
  T gradient_x, gradient_y;
  T slack;
  std::int32_t min_x, max_x, min_y, max_y;
  bool empty;
  bool clipped;  ///< the box is not that of the whole triangle

  [[gnu::always_inline]] Plane(const GridSamples<T>& samples, const GridCorner<T>& a,
                               const GridCorner<T>& b, const GridCorner<T>& c, T bound) {
    const std::int64_t bx = b.x - a.x, by = b.y - a.y;
    const std::int64_t cx = c.x - a.x, cy = c.y - a.y;
    const std::int64_t area = bx * cy - by * cx;
    const std::int32_t left = least(a.x, least(b.x, c.x));
    const std::int32_t right = greatest(a.x, greatest(b.x, c.x));
    const std::int32_t top = least(a.y, least(b.y, c.y));
    const std::int32_t bottom = greatest(a.y, greatest(b.y, c.y));
    min_x = greatest((left + kStep - 1) / kStep, samples.first_x);
    max_x = least(right / kStep, samples.last_x);
    min_y = greatest((top + kStep - 1) / kStep, samples.first_y);
    max_y = least(bottom / kStep, samples.last_y);
    clipped = max_x != right / kStep || max_y != bottom / kStep;
    // Twice the area 1 or a box of 2 x 2: no samples but the corners.
    empty = area <= 1 || (right - left <= 1 && bottom - top <= 1) || min_x > max_x || min_y > max_y;
    if (empty) return;
    const double inverse = 1.0 / static_cast<double>(area);
    const double bz = static_cast<double>(b.z) - static_cast<double>(a.z);
    const double cz = static_cast<double>(c.z) - static_cast<double>(a.z);
    const double slope_x = (bz * static_cast<double>(cy) - cz * static_cast<double>(by)) * inverse;
    const double slope_y = (cz * static_cast<double>(bx) - bz * static_cast<double>(cx)) * inverse;
    gradient_x = static_cast<T>(slope_x);
    gradient_y = static_cast<T>(slope_y);
    // Rounded are: the gradients, 2 products, 3 sums. In double the gradients are rounded several
    // times, in proportion to the terms of their sums, which are bounded by |difference of heights|
    // * extent / area.
    const double width = right - left, height = bottom - top;
    const double rise = __builtin_fabs(slope_x) * width + __builtin_fabs(slope_y) * height;
    double rounded = Kernel<T>::kRounding * (6.5 * rise + 4.0 * static_cast<double>(bound));
    if (Kernel<T>::kLanes == 8)
      rounded +=
          0x1p-50 * (__builtin_fabs(bz) + __builtin_fabs(cz)) * (2.0 * width * height * inverse);
    slack = static_cast<T>(rounded);
  }
};

/// Edge functions of the samples: not negative for those on the left of a side or on it.
template <class T, int kStep>
struct Sides {
  typename Kernel<T>::Int along_x[3], along_y[3], start[3];

  [[gnu::always_inline]] Sides(const Plane<T, kStep>& plane, const GridCorner<T>& a,
                               const GridCorner<T>& b, const GridCorner<T>& c) {
    set(0, plane, a, b);
    set(1, plane, b, c);
    set(2, plane, c, a);
  }
  [[gnu::always_inline]] void set(int i, const Plane<T, kStep>& plane, const GridCorner<T>& p,
                                  const GridCorner<T>& q) {
    along_x[i] = p.y - q.y;
    along_y[i] = q.x - p.x;
    start[i] = along_x[i] * (kStep * plane.min_x - p.x) + along_y[i] * (kStep * plane.min_y - p.y);
    along_x[i] *= kStep;
    along_y[i] *= kStep;
  }
};

/// The samples of a row that lie in a triangle, exactly: quotients are off integers by half of
/// their unit, far more than doubles round.
template <class T, int kStep>
struct Spans {
  double start[3], step[3], sign[3], scale[3];

  [[gnu::always_inline]] Spans(const Plane<T, kStep>& plane, const GridCorner<T>& a,
                               const GridCorner<T>& b, const GridCorner<T>& c) {
    set(0, plane, a, b);
    set(1, plane, b, c);
    set(2, plane, c, a);
  }
  [[gnu::always_inline]] void set(int i, const Plane<T, kStep>& plane, const GridCorner<T>& p,
                                  const GridCorner<T>& q) {
    const double along_x = p.y - q.y, along_y = q.x - p.x;
    const double size = __builtin_fabs(along_x), unit = kStep * size;
    sign[i] = along_x;
    // left: sample >= ceil(n / unit), right: sample <= floor(n / unit)
    const double towards = along_x > 0 ? -along_y : along_y;
    const double half = along_x > 0 ? unit - 0.5 : 0.5;
    step[i] = kStep * towards;
    start[i] = towards * (kStep * plane.min_y - p.y) + p.x * size + half;
    scale[i] = along_x == 0 ? 0.0 : 1.0 / unit;
  }
  /// The columns of row plane.min_y + down.
  [[gnu::always_inline]] void row(double down, std::int32_t& left, std::int32_t& right) const {
    for (int i = 0; i < 3; ++i) {
      if (sign[i] == 0) continue;
      constexpr double kFar = 131072.0;
      const double at = (start[i] + step[i] * down) * scale[i];
      const double kept = at < -kFar ? -kFar : at > kFar ? kFar : at;
      const std::int32_t x = static_cast<std::int32_t>(kept + kFar) - 131072;
      if (sign[i] > 0) {
        left = greatest(left, x);
      } else {
        right = least(right, x);
      }
    }
  }
};

}  // namespace
}  // namespace terrace::tri::tin
