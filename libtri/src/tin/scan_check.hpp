// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan.hpp"
#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

using Bytes = std::uint8_t __attribute__((vector_size(8)));

constexpr Reals8 kLane = {0, 1, 2, 3, 4, 5, 6, 7};

[[gnu::always_inline]] inline Reals8 load(const float* from) {
  float __attribute__((vector_size(32))) lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return __builtin_convertvector(lanes, Reals8);
}
[[gnu::always_inline]] inline Reals8 load(const double* from) { return Lanes<double>::load(from); }

/// Rounds a non-negative number up.
[[gnu::always_inline]] inline std::int64_t round_up(double value) {
  const auto down = static_cast<std::int64_t>(value);
  return static_cast<double>(down) < value ? down + 1 : down;
}

/// Adds the samples in one triangle to the sums.
template <class T>
struct Taker {
  const CheckWindow<T>& window;
  double base, slope_x;
  Reals8 max_error, squares;
  Ints8 covered;
  Ints8 missing = {};

  [[gnu::always_inline]] Taker(const CheckWindow<T>& samples, const CheckTriangle& triangle,
                               double slope, const CheckSums& sums)
      : window(samples), base(triangle.a[2]), slope_x(slope) {
    __builtin_memcpy(&max_error, sums.max_error, sizeof max_error);
    __builtin_memcpy(&squares, sums.squares, sizeof squares);
    __builtin_memcpy(&covered, sums.covered, sizeof covered);
  }

  /// Adds the samples marked by `inside` from a block that starts at number `at`. `dx`: its
  /// columns relative to the first corner. `rise_y`: how far the plane rises from that corner to
  /// the row.
  [[gnu::always_inline]] void take(std::int64_t at, Ints8 inside, Reals8 dx, double rise_y) {
    const std::int64_t left = window.columns * window.rows - at;
    Reals8 height;
    if (left >= kCheckLanes) {
      height = load(window.heights + at);
    } else {
      T last[kCheckLanes] = {};
      for (std::int64_t i = 0; i < left; ++i) last[i] = window.heights[at + i];
      height = load(last);
    }
    const Ints8 with_data = (Ints8)(height - height == 0.0);
    missing |= inside & ~with_data;
    const Ints8 ok = inside & with_data;
    // Relative to a corner, which preserves precision if heights are large.
    const Reals8 difference = (height - base) - (rise_y + slope_x * dx);
    const Reals8 error = (Reals8)((Ints8)Lanes<double>::absolute(difference) & ok);
    max_error = error > max_error ? error : max_error;
    Bytes flags;
    __builtin_memcpy(&flags, window.flags + at, sizeof flags);
    const Ints8 counted = __builtin_convertvector(flags, Ints8);
    const Ints8 first = ok & (Ints8)(counted == 0);
    squares += (Reals8)((Ints8)(error * error) & first);
    covered -= first;
    flags = __builtin_convertvector(counted | (ok & 1), Bytes);
    __builtin_memcpy(window.flags + at, &flags, sizeof flags);
  }

  [[gnu::always_inline]] bool finish(CheckSums& sums) const {
    __builtin_memcpy(sums.max_error, &max_error, sizeof max_error);
    __builtin_memcpy(sums.squares, &squares, sizeof squares);
    __builtin_memcpy(sums.covered, &covered, sizeof covered);
    std::int64_t any = 0;
    for (int i = 0; i < kCheckLanes; ++i) any |= missing[i];
    return any != 0;
  }
};

template <class T>
bool check_in(const CheckWindow<T>& window, const CheckTriangle& triangle, CheckSums& sums) {
  const double *const a = triangle.a, *const b = triangle.b, *const c = triangle.c;
  const double* const corner[4] = {a, b, c, a};
  const double bz = b[2] - a[2], cz = c[2] - a[2];
  const double slope_x = (bz * (c[1] - a[1]) - cz * (b[1] - a[1])) / triangle.area;
  const double slope_y = (cz * (b[0] - a[0]) - bz * (c[0] - a[0])) / triangle.area;
  const double tolerance = window.tolerance;
  const double left = greatest(0.0, least(a[0], least(b[0], c[0])) - tolerance);
  const double right = least(static_cast<double>(window.columns - 1),
                             greatest(a[0], greatest(b[0], c[0])) + tolerance);
  const double highest = greatest(0.0, least(a[1], least(b[1], c[1])) - tolerance);
  const double lowest =
      least(static_cast<double>(window.rows - 1), greatest(a[1], greatest(b[1], c[1])) + tolerance);
  if (!(left <= right) || !(highest <= lowest)) return false;
  Taker<T> taker(window, triangle, slope_x, sums);
  const std::int64_t first = round_up(left);
  const std::int64_t top = round_up(highest), bottom = static_cast<std::int64_t>(lowest);
  // A sample is inside if along_x (x - p.x) + along_y (y - p.y) + margin >= 0.
  double along_x[3], along_y[3];
  for (int i = 0; i < 3; ++i) {
    along_x[i] = corner[i][1] - corner[i + 1][1];
    along_y[i] = corner[i + 1][0] - corner[i][0];
  }
  // In narrower boxes divisions would take longer than the blocks outside the triangle.
  if (right - left < 8 * kCheckLanes) {
    for (std::int64_t x = first; static_cast<double>(x) <= right; x += kCheckLanes) {
      const Reals8 columns = static_cast<double>(x) + kLane;
      const Reals8 dx = columns - a[0];
      const Reals8 before_right = right - columns;
      Reals8 edge[3];
      for (int i = 0; i < 3; ++i)
        edge[i] = along_x[i] * (columns - corner[i][0]) + triangle.margin[i];
      for (std::int64_t row = top; row <= bottom; ++row) {
        const auto y = static_cast<double>(row);
        Reals8 inside = before_right;
        for (int i = 0; i < 3; ++i) {
          const Reals8 of_edge = edge[i] + along_y[i] * (y - corner[i][1]);
          inside = of_edge < inside ? of_edge : inside;
        }
        taker.take(row * window.columns + x, (Ints8)(inside >= 0.0), dx, slope_y * (y - a[1]));
      }
    }
    return taker.finish(sums);
  }
  for (std::int64_t row = top; row <= bottom; ++row) {
    const auto y = static_cast<double>(row);
    double from = left, to = right;
    for (int i = 0; i < 3; ++i) {
      const double offset = along_y[i] * (y - corner[i][1]) + triangle.margin[i];
      if (along_x[i] > 0) {
        from = greatest(from, corner[i][0] - offset / along_x[i]);
      } else if (along_x[i] < 0) {
        to = least(to, corner[i][0] - offset / along_x[i]);
      } else if (offset < 0) {
        to = -1;
      }
    }
    if (!(from <= to)) continue;
    const auto last = static_cast<std::int64_t>(to);
    const double rise_y = slope_y * (y - a[1]);
    for (std::int64_t x = round_up(from); x <= last; x += kCheckLanes) {
      const Reals8 columns = static_cast<double>(x) + kLane;
      taker.take(row * window.columns + x, (Ints8)(columns <= static_cast<double>(last)),
                 columns - a[0], rise_y);
    }
  }
  return taker.finish(sums);
}

}  // namespace
}  // namespace terrace::tri::tin
