// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan.hpp"
#include "tin/scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

/// The triangle's plane relative to its first corner, the box of the samples to scan, and a bound
/// of the rounding error of errors. The samples are those of every kStep-th column and row. The box
/// is numbered in these, corners in columns and rows.
template <class T, int kStep>
struct Plane {
  using Real = T;
  T gradient_x, gradient_y;
  T slack;
  std::int32_t min_x, max_x, min_y, max_y;
  bool empty;
  bool clipped;  ///< the box does not cover the whole triangle

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
    // Twice the area is 1, or the box is 2 x 2, so there are only corners.
    empty = area <= 1 || (right - left <= 1 && bottom - top <= 1) || min_x > max_x || min_y > max_y;
    if (empty) return;
    const double inverse = 1.0 / static_cast<double>(area);
    const double bz = static_cast<double>(b.z) - static_cast<double>(a.z);
    const double cz = static_cast<double>(c.z) - static_cast<double>(a.z);
    const double slope_x = (bz * static_cast<double>(cy) - cz * static_cast<double>(by)) * inverse;
    const double slope_y = (cz * static_cast<double>(bx) - bz * static_cast<double>(cx)) * inverse;
    gradient_x = static_cast<T>(slope_x);
    gradient_y = static_cast<T>(slope_y);
    // Rounding errors come from the gradients, 2 products and 3 sums. In double the gradients are
    // rounded several times, in proportion to the terms of their sums, which are bounded by
    // |difference of heights| * extent / area.
    const double width = right - left, height = bottom - top;
    const double rise = __builtin_fabs(slope_x) * width + __builtin_fabs(slope_y) * height;
    double rounded = Lanes<T>::kRounding * (6.5 * rise + 4.0 * static_cast<double>(bound));
    if (Lanes<T>::kLanes == 8)
      rounded +=
          0x1p-50 * (__builtin_fabs(bz) + __builtin_fabs(cz)) * (2.0 * width * height * inverse);
    slack = static_cast<T>(rounded);
  }
};

/// Edge functions, which are not negative for samples to the left of a side or on it.
template <class T, int kStep>
struct Sides {
  typename Lanes<T>::Int along_x[3], along_y[3], start[3];

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

/// The exact samples of a row that are in a triangle. Quotients differ from integers by at least
/// half their unit, far more than rounding.
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
  /// Computes the columns of row plane.min_y + down.
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

/// Visits blocks of kWidth columns, for boxes that are no wider. Calls visit(errors, inside, x, y,
/// columns) with the errors of the block at (x, y) until it returns false.
template <int kWidth, class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const GridSamples<T>& samples,
                                               const Plane<T, kStep>& plane, const GridCorner<T>& a,
                                               const GridCorner<T>& b, const GridCorner<T>& c,
                                               const Visit& visit) {
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  constexpr int kHeight = K::kLanes / kWidth;
  const Ints lane_x = K::kLane & (kWidth - 1);
  const Ints lane_y = K::kLane / kWidth;
  const Sides<T, kStep> sides(plane, a, b, c);
  Ints edge[3], step[3];
  for (int i = 0; i < 3; ++i) {
    edge[i] = sides.start[i] + sides.along_x[i] * lane_x + sides.along_y[i] * lane_y;
    step[i] = sides.along_y[i] * kHeight - Ints{};
  }
  const T base = a.z;
  const Reals x =
      static_cast<T>(kStep * plane.min_x - a.x) + __builtin_convertvector(kStep * lane_x, Reals);
  const Reals rise_x = plane.gradient_x * x;
  const Reals rows = __builtin_convertvector(kStep * lane_y, Reals);
  const T* row =
      samples.heights + static_cast<std::size_t>(plane.min_y) * samples.stride + plane.min_x;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; y += kHeight) {
    Reals z;
    if constexpr (kHeight == 1) {
      z = K::load(row);
    } else if constexpr (kHeight == 2) {
      z = K::load_halves(row, row + samples.stride);
    } else {
      z = K::load_quarters(row, samples.stride);
    }
    const Reals down = static_cast<T>(kStep * y - a.y) + rows;
    const Reals difference = (z - base) - (rise_x + plane.gradient_y * down);
    const Reals error = K::absolute(difference);
    auto inside = not_negative(edge[0] | edge[1] | edge[2]);
    if (plane.clipped)
      inside = both(inside, both(at_most(lane_x, Int{plane.max_x - plane.min_x} - Ints{}),
                                 at_most(lane_y, Int{plane.max_y - y} - Ints{})));
    if (!visit(error, inside, plane.min_x, y, kWidth)) return;
    for (int i = 0; i < 3; ++i) edge[i] += step[i];
    row += samples.stride * kHeight;
  }
}

template <class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_rows(const GridSamples<T>& samples,
                                             const Plane<T, kStep>& plane, const GridCorner<T>& a,
                                             const GridCorner<T>& b, const GridCorner<T>& c,
                                             const Visit& visit) {
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const Ints lane = K::kLane;
  const Spans<T, kStep> spans(plane, a, b, c);
  const Reals columns = __builtin_convertvector(kStep * lane, Reals);
  const T base = a.z;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; ++y) {
    std::int32_t left = plane.min_x, right = plane.max_x;
    spans.row(y - plane.min_y, left, right);
    const T* row = samples.heights + static_cast<std::size_t>(y) * samples.stride;
    const T rise_y = plane.gradient_y * static_cast<T>(kStep * y - a.y);
    for (std::int32_t x = left; x <= right; x += K::kLanes) {
      const Reals z = K::load(row + x);
      const Reals across = static_cast<T>(kStep * x - a.x) + columns;
      const Reals difference = (z - base) - (plane.gradient_x * across + rise_y);
      const Reals error = K::absolute(difference);
      const auto inside = at_most(lane, Int{right - x} - Ints{});
      if (!visit(error, inside, x, y, K::kLanes)) return;
    }
  }
}

template <class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_triangle(const GridSamples<T>& samples,
                                                 const Plane<T, kStep>& plane,
                                                 const GridCorner<T>& a, const GridCorner<T>& b,
                                                 const GridCorner<T>& c, const Visit& visit) {
  const std::int32_t width = plane.max_x - plane.min_x + 1;
  constexpr int kLanes = Lanes<T>::kLanes;
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

/// Errors are compared as the integers with their bits, so that NaN is greater than all others. No
/// branch depends on errors before the end, because new maxima cannot be predicted.
///
/// Corners are never the worst, as their errors are at most `slack`, which is at most `limit`.
template <class T, int kStep>
WorstSample<T> worst_in(const GridSamples<T>& samples, const GridCorner<T>& a,
                        const GridCorner<T>& b, const GridCorner<T>& c, T bound) {
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const Plane<T, kStep> plane(samples, a, b, c, bound);
  if (plane.empty) return {0, 0};
  T limit = bound - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return {T{kUnsure}, 0};
  } else {
    limit = greatest(limit, plane.slack);
  }
  Ints most = (Ints)(limit - Reals{});
  Ints block = {};  // the block of each lane's worst sample
  auto grown = more(most, most);
  int width = 1;
  scan_triangle(
      samples, plane, a, b, c,
      [&](Reals error, auto inside, std::int32_t x, std::int32_t y, int columns)
          __attribute__((always_inline)) {
            const Ints own = (Ints)kept(error, inside);
            const auto grew = more(own, most);
            most = chosen(grew, own, most);
            const auto place = static_cast<std::uint32_t>(y) << 16 | static_cast<std::uint32_t>(x);
            block = chosen(grew, static_cast<Int>(place) - Ints{}, block);
            grown = either(grown, grew);
            width = columns;
            return true;
          });
  if (bits_of(grown) == 0) return {0, 0};
  const Int greatest_bits = K::greatest_lane(most);
  T error;
  __builtin_memcpy(&error, &greatest_bits, sizeof error);
  if (!(error < static_cast<T>(__builtin_inf()))) return {static_cast<T>(__builtin_inf()), 0};
  std::uint32_t first = 0xFFFFFFFF;
  for (unsigned lanes = equal(most, greatest_bits - Ints{}); lanes != 0; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    const auto corner = static_cast<std::uint32_t>(block[lane]);
    const auto x = (corner & 0xFFFF) + static_cast<std::uint32_t>(lane & (width - 1));
    const auto y = (corner >> 16) + static_cast<std::uint32_t>(lane / width);
    first = least(first, y * kStep << 16 | x * kStep);
  }
  return {error, first};
}

template <class T>
int within_in(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
              const GridCorner<T>& c, T bound) {
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  const Plane<T, 1> plane(samples, a, b, c, bound);
  if (plane.empty) return 1;
  T allowed = bound - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return kUnsure;
  } else {
    allowed = greatest(allowed, plane.slack);
  }
  bool within = true;
  scan_triangle(
      samples, plane, a, b, c,
      [&](Reals error, auto inside, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            within = beyond(error, allowed - Reals{}, inside) == 0;
            return within;
          });
  return within ? 1 : 0;
}

}  // namespace
}  // namespace terrace::tri::tin
