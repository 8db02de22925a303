// SPDX-License-Identifier: Apache-2.0
#pragma once

// The loop that checks a TIN against its raster (CheckScan in scan.hpp): adds the samples in one
// triangle to the sums. The rules in scan_lanes.hpp apply here.
#include "scan.hpp"
#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

using Bytes = std::uint8_t __attribute__((vector_size(8)));

constexpr Reals8 kLaneNumbers = {0, 1, 2, 3, 4, 5, 6, 7};

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
struct TriangleSums {
  const CheckWindow<T>& window;
  double corner_height, slope_x;
  Reals8 max_error, squares;
  Ints8 covered;
  Ints8 missing = {};

  [[gnu::always_inline]] TriangleSums(const CheckWindow<T>& samples, const CheckTriangle& triangle,
                                      double slope, const CheckSums& sums)
      : window(samples), corner_height(triangle.a[2]), slope_x(slope) {
    __builtin_memcpy(&max_error, sums.max_error, sizeof max_error);
    __builtin_memcpy(&squares, sums.squares, sizeof squares);
    __builtin_memcpy(&covered, sums.covered, sizeof covered);
  }

  /// Adds the samples of a block that `inside` marks. at: index of its first sample. dx: columns
  /// relative to corner a. rise_y: rise of the plane from corner a to this row.
  [[gnu::always_inline]] void add_block(std::int64_t at, Ints8 inside, Reals8 dx, double rise_y) {
    const std::int64_t remaining = window.columns * window.rows - at;
    Reals8 height;
    if (remaining >= kCheckLanes) {
      height = load(window.heights + at);
    } else {
      T last[kCheckLanes] = {};
      for (std::int64_t i = 0; i < remaining; ++i) last[i] = window.heights[at + i];
      height = load(last);
    }
    const Ints8 with_data = (Ints8)(height - height == 0.0);
    missing |= inside & ~with_data;
    const Ints8 used = inside & with_data;
    // Relative to a corner, which preserves precision if heights are large.
    const Reals8 difference = (height - corner_height) - (rise_y + slope_x * dx);
    const Reals8 error = (Reals8)((Ints8)Lanes<double>::absolute(difference) & used);
    max_error = error > max_error ? error : max_error;
    Bytes flags;
    __builtin_memcpy(&flags, window.flags + at, sizeof flags);
    const Ints8 seen = __builtin_convertvector(flags, Ints8);
    const Ints8 newly_seen = used & (Ints8)(seen == 0);
    squares += (Reals8)((Ints8)(error * error) & newly_seen);
    covered -= newly_seen;
    flags = __builtin_convertvector(seen | (used & 1), Bytes);
    __builtin_memcpy(window.flags + at, &flags, sizeof flags);
  }

  /// Stores the sums. Returns true if a marked sample has no data.
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
  const double rise_b = b[2] - a[2], rise_c = c[2] - a[2];
  const double slope_x = (rise_b * (c[1] - a[1]) - rise_c * (b[1] - a[1])) / triangle.area;
  const double slope_y = (rise_c * (b[0] - a[0]) - rise_b * (c[0] - a[0])) / triangle.area;
  const double tolerance = window.tolerance;
  const double min_column = greatest(0.0, least(a[0], least(b[0], c[0])) - tolerance);
  const double max_column = least(static_cast<double>(window.columns - 1),
                                  greatest(a[0], greatest(b[0], c[0])) + tolerance);
  const double min_row = greatest(0.0, least(a[1], least(b[1], c[1])) - tolerance);
  const double max_row =
      least(static_cast<double>(window.rows - 1), greatest(a[1], greatest(b[1], c[1])) + tolerance);
  if (!(min_column <= max_column) || !(min_row <= max_row)) return false;
  TriangleSums<T> triangle_sums(window, triangle, slope_x, sums);
  const std::int64_t first_column = round_up(min_column);
  const std::int64_t first_row = round_up(min_row), last_row = static_cast<std::int64_t>(max_row);
  // A sample is inside if normal_x (x - p.x) + normal_y (y - p.y) + margin >= 0 for each side, with
  // p its first corner.
  double normal_x[3], normal_y[3];
  for (int i = 0; i < 3; ++i) {
    normal_x[i] = corner[i][1] - corner[i + 1][1];
    normal_y[i] = corner[i + 1][0] - corner[i][0];
  }
  // In a narrow box, testing all blocks is cheaper than dividing to find the ends of each row.
  if (max_column - min_column < 8 * kCheckLanes) {
    for (std::int64_t x = first_column; static_cast<double>(x) <= max_column; x += kCheckLanes) {
      const Reals8 columns = static_cast<double>(x) + kLaneNumbers;
      const Reals8 dx = columns - a[0];
      const Reals8 before_max = max_column - columns;
      Reals8 edge[3];
      for (int i = 0; i < 3; ++i)
        edge[i] = normal_x[i] * (columns - corner[i][0]) + triangle.margin[i];
      for (std::int64_t row = first_row; row <= last_row; ++row) {
        const auto y = static_cast<double>(row);
        Reals8 inside = before_max;
        for (int i = 0; i < 3; ++i) {
          const Reals8 of_edge = edge[i] + normal_y[i] * (y - corner[i][1]);
          inside = of_edge < inside ? of_edge : inside;
        }
        triangle_sums.add_block(row * window.columns + x, (Ints8)(inside >= 0.0), dx,
                                slope_y * (y - a[1]));
      }
    }
    return triangle_sums.finish(sums);
  }
  for (std::int64_t row = first_row; row <= last_row; ++row) {
    const auto y = static_cast<double>(row);
    double from = min_column, to = max_column;
    for (int i = 0; i < 3; ++i) {
      const double offset = normal_y[i] * (y - corner[i][1]) + triangle.margin[i];
      if (normal_x[i] > 0) {
        from = greatest(from, corner[i][0] - offset / normal_x[i]);
      } else if (normal_x[i] < 0) {
        to = least(to, corner[i][0] - offset / normal_x[i]);
      } else if (offset < 0) {
        to = -1;
      }
    }
    if (!(from <= to)) continue;
    const auto last = static_cast<std::int64_t>(to);
    const double rise_y = slope_y * (y - a[1]);
    for (std::int64_t x = round_up(from); x <= last; x += kCheckLanes) {
      const Reals8 columns = static_cast<double>(x) + kLaneNumbers;
      triangle_sums.add_block(row * window.columns + x,
                              (Ints8)(columns <= static_cast<double>(last)), columns - a[0],
                              rise_y);
    }
  }
  return triangle_sums.finish(sums);
}

}  // namespace
}  // namespace terrace::tri::tin
