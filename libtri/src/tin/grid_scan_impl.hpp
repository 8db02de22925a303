// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Included once for each instruction set, with functions bits_of() for masks of 16 ints and of 8
// longs defined before: what is here must not be shared between objects, so nothing has a name
// outside its object, and no function of another header is called.
#include "grid_scan.hpp"

namespace terrace::tri::tin {
namespace {

template <class T>
struct Kernel;

template <>
struct Kernel<float> {
  static constexpr int kLanes = 16;
  using Int = std::int32_t;
  using Reals = float __attribute__((vector_size(64)));
  using Ints = std::int32_t __attribute__((vector_size(64)));
  using Quarter = float __attribute__((vector_size(16)));
  using Half = float __attribute__((vector_size(32)));
  [[gnu::always_inline]] static float greatest_lane(Reals lanes) {
    const Half low = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7);
    const Half high = __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
    const Half eight = high > low ? high : low;
    const Quarter first = __builtin_shufflevector(eight, eight, 0, 1, 2, 3);
    const Quarter second = __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
    Quarter four = second > first ? second : first;
    const Quarter swapped = __builtin_shufflevector(four, four, 2, 3, 0, 1);
    four = swapped > four ? swapped : four;
    return four[1] > four[0] ? four[1] : four[0];
  }
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  static constexpr Int kSignless = 0x7FFFFFFF;
  static constexpr float kRounding = 0x1p-24F;

  [[gnu::always_inline]] static Reals load(const float* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_pair(const float* from, std::size_t stride) {
    Half a, b;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
  [[gnu::always_inline]] static Reals load_four(const float* from, std::size_t stride) {
    Quarter a, b, c, d;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    __builtin_memcpy(&c, from + 2 * stride, sizeof c);
    __builtin_memcpy(&d, from + 3 * stride, sizeof d);
    const Half ab = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
    const Half cd = __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7);
    return __builtin_shufflevector(ab, cd, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
};

template <>
struct Kernel<double> {
  static constexpr int kLanes = 8;
  using Int = std::int64_t;
  using Reals = double __attribute__((vector_size(64)));
  using Ints = std::int64_t __attribute__((vector_size(64)));
  using Half = double __attribute__((vector_size(32)));
  [[gnu::always_inline]] static double greatest_lane(Reals lanes) {
    double greatest = lanes[0];
    for (int i = 1; i < kLanes; ++i) greatest = lanes[i] > greatest ? lanes[i] : greatest;
    return greatest;
  }
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7};
  static constexpr Int kSignless = 0x7FFFFFFFFFFFFFFF;
  static constexpr double kRounding = 0x1p-53;

  [[gnu::always_inline]] static Reals load(const double* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_pair(const double* from, std::size_t stride) {
    Half a, b;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
  }
};

template <class V>
[[gnu::always_inline]] inline V least(V a, V b) {
  return b < a ? b : a;
}
template <class V>
[[gnu::always_inline]] inline V greatest(V a, V b) {
  return b > a ? b : a;
}

/// The triangle's plane relative to its first corner, the box of the samples to look at, and what
/// rounding may do to an error.
template <class T>
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
    min_x = greatest(left, samples.first_x);
    max_x = least(right, samples.last_x);
    min_y = greatest(top, samples.first_y);
    max_y = least(bottom, samples.last_y);
    clipped = max_x != right || max_y != bottom;
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

/// Edge functions: not negative for samples on the left of a side or on it.
template <class T>
struct Sides {
  typename Kernel<T>::Int along_x[3], along_y[3], start[3];

  [[gnu::always_inline]] Sides(const Plane<T>& plane, const GridCorner<T>& a,
                               const GridCorner<T>& b, const GridCorner<T>& c) {
    set(0, plane, a, b);
    set(1, plane, b, c);
    set(2, plane, c, a);
  }
  [[gnu::always_inline]] void set(int i, const Plane<T>& plane, const GridCorner<T>& p,
                                  const GridCorner<T>& q) {
    along_x[i] = p.y - q.y;
    along_y[i] = q.x - p.x;
    start[i] = along_x[i] * (plane.min_x - p.x) + along_y[i] * (plane.min_y - p.y);
  }
};

/// Blocks of kWidth columns, for boxes that are no wider. Calls visit(errors, inside, x, y) with
/// the errors of the block at (x, y) until that returns false.
template <int kWidth, class T, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const GridSamples<T>& samples, const Plane<T>& plane,
                                               const GridCorner<T>& a, const GridCorner<T>& b,
                                               const GridCorner<T>& c, const Visit& visit) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  constexpr int kHeight = K::kLanes / kWidth;
  const Ints lane_x = K::kLane & (kWidth - 1);
  const Ints lane_y = K::kLane / kWidth;
  const Sides<T> sides(plane, a, b, c);
  Ints edge[3], step[3];
  for (int i = 0; i < 3; ++i) {
    edge[i] = sides.start[i] + sides.along_x[i] * lane_x + sides.along_y[i] * lane_y;
    step[i] = sides.along_y[i] * kHeight - Ints{};
  }
  const T base = a.z;
  const Reals x = static_cast<T>(plane.min_x - a.x) + __builtin_convertvector(lane_x, Reals);
  const Reals rise_x = plane.gradient_x * x;
  const Reals rows = __builtin_convertvector(lane_y, Reals);
  const T* row =
      samples.heights + static_cast<std::size_t>(plane.min_y) * samples.stride + plane.min_x;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; y += kHeight) {
    Reals z;
    if constexpr (kHeight == 1) {
      z = K::load(row);
    } else if constexpr (kHeight == 2) {
      z = K::load_pair(row, samples.stride);
    } else {
      z = K::load_four(row, samples.stride);
    }
    const Reals down = static_cast<T>(y - a.y) + rows;
    const Reals difference = (z - base) - (rise_x + plane.gradient_y * down);
    const Reals error = (Reals)((Ints)difference & K::kSignless);
    Ints inside = (edge[0] | edge[1] | edge[2]) >= 0;
    if (plane.clipped)
      inside &= (lane_x <= Int{plane.max_x - plane.min_x}) & (lane_y <= Int{plane.max_y - y});
    if (!visit(error, inside, plane.min_x, y, kWidth)) return;
    for (int i = 0; i < 3; ++i) edge[i] += step[i];
    row += samples.stride * kHeight;
  }
}

/// The columns of a row that lie in a triangle, exactly: quotients are off integers by half of
/// their unit, far more than doubles round.
template <class T>
struct Spans {
  double start[3], step[3], sign[3], scale[3];
  std::int32_t offset[3];

  [[gnu::always_inline]] Spans(const Plane<T>& plane, const GridCorner<T>& a,
                               const GridCorner<T>& b, const GridCorner<T>& c) {
    set(0, plane, a, b);
    set(1, plane, b, c);
    set(2, plane, c, a);
  }
  [[gnu::always_inline]] void set(int i, const Plane<T>& plane, const GridCorner<T>& p,
                                  const GridCorner<T>& q) {
    const double along_x = p.y - q.y, along_y = q.x - p.x;
    const double size = __builtin_fabs(along_x);
    sign[i] = along_x;
    // left: x >= p.x + ceil(n / size), right: x <= p.x + floor(n / size)
    const double towards = along_x > 0 ? -along_y : along_y;
    const double half = along_x > 0 ? size - 0.5 : 0.5;
    const double inverse = along_x == 0 ? 0.0 : 1.0 / size;
    step[i] = towards;
    start[i] = towards * (plane.min_y - p.y) + half;
    scale[i] = inverse;
    offset[i] = p.x;
  }
  /// Of row plane.min_y + down.
  [[gnu::always_inline]] void row(double down, std::int32_t& left, std::int32_t& right) const {
    for (int i = 0; i < 3; ++i) {
      if (sign[i] == 0) continue;
      constexpr double kFar = 131072.0;
      const double at = (start[i] + step[i] * down) * scale[i];
      const double kept = at < -kFar ? -kFar : at > kFar ? kFar : at;
      const std::int32_t x = static_cast<std::int32_t>(kept + kFar) - 131072 + offset[i];
      if (sign[i] > 0) {
        left = greatest(left, x);
      } else {
        right = least(right, x);
      }
    }
  }
};

template <class T, class Visit>
[[gnu::always_inline]] inline void scan_rows(const GridSamples<T>& samples, const Plane<T>& plane,
                                             const GridCorner<T>& a, const GridCorner<T>& b,
                                             const GridCorner<T>& c, const Visit& visit) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const Ints lane = K::kLane;
  const Spans<T> spans(plane, a, b, c);
  const Reals columns = __builtin_convertvector(lane, Reals);
  const T base = a.z;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; ++y) {
    std::int32_t left = plane.min_x, right = plane.max_x;
    spans.row(y - plane.min_y, left, right);
    const T* row = samples.heights + static_cast<std::size_t>(y) * samples.stride;
    const T rise_y = plane.gradient_y * static_cast<T>(y - a.y);
    for (std::int32_t x = left; x <= right; x += K::kLanes) {
      const Reals z = K::load(row + x);
      const Reals across = static_cast<T>(x - a.x) + columns;
      const Reals difference = (z - base) - (plane.gradient_x * across + rise_y);
      const Reals error = (Reals)((Ints)difference & K::kSignless);
      const Ints inside = lane <= Int{right - x};
      if (!visit(error, inside, x, y, K::kLanes)) return;
    }
  }
}

template <class T, class Visit>
[[gnu::always_inline]] inline void scan_triangle(const GridSamples<T>& samples,
                                                 const Plane<T>& plane, const GridCorner<T>& a,
                                                 const GridCorner<T>& b, const GridCorner<T>& c,
                                                 const Visit& visit) {
  const std::int32_t width = plane.max_x - plane.min_x + 1;
  constexpr int kLanes = Kernel<T>::kLanes;
  if (width <= 4) {
    scan_blocks<4>(samples, plane, a, b, c, visit);
  } else if (width <= 8) {
    scan_blocks<8>(samples, plane, a, b, c, visit);
  } else if (width <= kLanes) {
    scan_blocks<kLanes>(samples, plane, a, b, c, visit);
  } else {
    scan_rows(samples, plane, a, b, c, visit);
  }
}

/// Corners are never the worst: their errors are at most `slack`, which is at most `best`.
template <class T>
GridWorst<T> worst_in(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
                      const GridCorner<T>& c, T bound) {
  using K = Kernel<T>;
  const Plane<T> plane(samples, a, b, c, bound);
  GridWorst<T> worst{0, 0};
  if (plane.empty) return worst;
  T best = bound - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return {T{kUnsure}, 0};
  } else {
    best = greatest(best, plane.slack);
  }
  scan_triangle(
      samples, plane, a, b, c,
      [&](typename K::Reals error, typename K::Ints inside, std::int32_t x0, std::int32_t y0,
          int width) __attribute__((always_inline)) {
        // NaN counts as greater.
        const unsigned hits =
            bits_of((typename K::Ints)(~(error <= best - typename K::Reals{})) & inside);
        if (hits == 0) return true;
        if (bits_of((typename K::Ints)(error != error) & inside) != 0) {
          worst = {static_cast<T>(__builtin_inf()), 0};
          return false;
        }
        const typename K::Reals own = (typename K::Reals)((typename K::Ints)error & inside);
        best = K::greatest_lane(own);
        const int lane =
            __builtin_ctz(bits_of((typename K::Ints)(own == best - typename K::Reals{})));
        const std::int32_t x = x0 + (lane & (width - 1)), y = y0 + lane / width;
        worst = {best, static_cast<std::uint32_t>(y) << 16 | static_cast<std::uint32_t>(x)};
        return true;
      });
  return worst;
}

template <class T>
T most_in(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
          const GridCorner<T>& c, T bound, T limit) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  const Plane<T> plane(samples, a, b, c, bound);
  if (plane.empty) return 0;
  T allowed = limit - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return T{kUnsure};
  } else {
    if (bound < 2 * plane.slack) allowed = greatest(allowed, plane.slack);
  }
  Reals most{};
  bool within = true;
  scan_triangle(
      samples, plane, a, b, c,
      [&](Reals error, typename K::Ints inside, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            const Reals own = (Reals)((typename K::Ints)error & inside);
            within = bits_of((typename K::Ints)(~(own <= allowed - Reals{}))) == 0;
            most = own > most ? own : most;
            return within;
          });
  if (!within) return static_cast<T>(__builtin_inf());
  return least(static_cast<T>(K::greatest_lane(most) + plane.slack), bound);
}

}  // namespace
}  // namespace terrace::tri::tin
