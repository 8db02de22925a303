// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a scan knows of its triangle before it looks at samples, for point_rows_scan_impl.hpp. The
// rules there hold here.
#include "scan.hpp"

namespace terrace::tri::tin::rows {
namespace {

using Half = double __attribute__((vector_size(32)));
constexpr int kLanes = 8;
constexpr double kColumnMargin = 0.01;
constexpr double kFlat = 1e-6;

[[gnu::always_inline]] inline Reals load(const double* from) {
  Reals lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
/// Four of one row and four of another.
[[gnu::always_inline]] inline Reals load_two(const double* upper, const double* lower) {
  Half a, b;
  __builtin_memcpy(&a, upper, sizeof a);
  __builtin_memcpy(&b, lower, sizeof b);
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}
[[gnu::always_inline]] inline Reals size_of(Reals lanes) {
  return (Reals)((Ints)lanes & 0x7FFFFFFFFFFFFFFF);
}
[[gnu::always_inline]] inline double least(double a, double b) { return b < a ? b : a; }
[[gnu::always_inline]] inline double greatest(double a, double b) { return b > a ? b : a; }

/// The first of `count` ascending places that is not below `from`.
[[gnu::always_inline]] inline std::int32_t first_not_below(const double* places, std::int32_t count,
                                                           double per_unit, double from) {
  const double guess = least(greatest((from - places[0]) * per_unit, 0.0), count);
  auto at = static_cast<std::int32_t>(guess);
  while (places[at] < from) ++at;
  while (places[at - 1] >= from) --at;
  return at;
}
/// The first that is above `to`.
[[gnu::always_inline]] inline std::int32_t first_above(const double* places, std::int32_t count,
                                                       double per_unit, double to) {
  const double guess = least(greatest((to - places[0]) * per_unit + 1.0, 0.0), count);
  auto at = static_cast<std::int32_t>(guess);
  while (places[at] <= to) ++at;
  while (places[at - 1] > to) --at;
  return at;
}

/// A box of the lattice, a little too large where samples are only about equally spaced.
struct Box {
  std::int32_t first_column, last_column, first_row, last_row;
};

/// The samples to look at between places.
[[gnu::always_inline]] inline Box box_between(const RowSamples& samples, double min_x, double max_x,
                                              double min_y, double max_y) {
  return {first_not_below(samples.x, samples.columns, samples.column_x, min_x),
          first_above(samples.x, samples.columns, samples.column_x, max_x) - 1,
          first_not_below(samples.y, samples.rows, samples.row_y, min_y),
          first_above(samples.y, samples.rows, samples.row_y, max_y) - 1};
}

[[gnu::always_inline]] inline double column_of(const RowSamples& samples, const RowCorner& p) {
  return samples.column_0 + (samples.column_x * p.x + samples.column_y * p.y);
}
[[gnu::always_inline]] inline double row_of(const RowSamples& samples, const RowCorner& p) {
  return samples.row_0 + (samples.row_x * p.x + samples.row_y * p.y);
}

/// Whole numbers not below and not above, within 0 to `count` - 1 or one beyond.
[[gnu::always_inline]] inline std::int32_t whole_from(double low, std::int32_t count) {
  const double kept = least(greatest(low, 0.0), count);
  const auto down = static_cast<std::int32_t>(kept);
  return down + (static_cast<double>(down) < kept ? 1 : 0);
}
[[gnu::always_inline]] inline std::int32_t whole_to(double high, std::int32_t count) {
  return static_cast<std::int32_t>(least(greatest(high, -1.0), count - 1) + 1.0) - 1;
}

[[gnu::always_inline]] inline Box box_around(const RowSamples& samples, const RowCorner& a,
                                             const RowCorner& b, const RowCorner& c) {
  const double p[3] = {column_of(samples, a), column_of(samples, b), column_of(samples, c)};
  const double q[3] = {row_of(samples, a), row_of(samples, b), row_of(samples, c)};
  return {whole_from(least(p[0], least(p[1], p[2])) - samples.off, samples.columns),
          whole_to(greatest(p[0], greatest(p[1], p[2])) + samples.off, samples.columns),
          whole_from(least(q[0], least(q[1], q[2])) - samples.off, samples.rows),
          whole_to(greatest(q[0], greatest(q[1], q[2])) + samples.off, samples.rows)};
}

template <bool kUpright>
struct Face {
  double gradient_x, gradient_y;
  double inverse;  ///< of twice the area
  double slack;    ///< what rounding may do to an error
  double margin;   ///< what it may do to an edge function, negative
  double start_x[3], start_y[3], along_x[3], along_y[3];  ///< of the sides
  Box box;
  bool empty;

  [[gnu::always_inline]] Face(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                              const RowCorner& c) {
    const double min_x = least(a.x, least(b.x, c.x)), max_x = greatest(a.x, greatest(b.x, c.x));
    const double min_y = least(a.y, least(b.y, c.y)), max_y = greatest(a.y, greatest(b.y, c.y));
    if constexpr (kUpright) {
      box = box_between(samples, min_x, max_x, min_y, max_y);
    } else {
      box = box_around(samples, a, b, c);
    }
    empty = box.first_row > box.last_row || box.first_column > box.last_column;
    if (empty) return;
    const double bx = b.x - a.x, by = b.y - a.y, bz = b.z - a.z;
    const double cx = c.x - a.x, cy = c.y - a.y, cz = c.z - a.z;
    inverse = 1.0 / (bx * cy - by * cx);
    gradient_x = (bz * cy - cz * by) * inverse;
    gradient_y = (cz * bx - bz * cx) * inverse;
    const double width = max_x - min_x, height = max_y - min_y;
    // Rounded are: the gradients several times, in proportion to the terms of their sums; 2
    // products, differences of places and heights and 2 sums.
    const double rise = __builtin_fabs(gradient_x) * width + __builtin_fabs(gradient_y) * height;
    const double heights = __builtin_fabs(a.z) + __builtin_fabs(bz) + __builtin_fabs(cz);
    slack = 0x1p-51 * (rise + heights) +
            0x1p-50 * (__builtin_fabs(bz) + __builtin_fabs(cz)) * (2.0 * width * height * inverse);
    margin = -0x1p-49 * (width * height);
    const RowCorner* const corner[3] = {&a, &b, &c};
    for (int i = 0; i < 3; ++i) {
      const RowCorner& from = *corner[i];
      const RowCorner& to = *corner[i == 2 ? 0 : i + 1];
      start_x[i] = from.x;
      start_y[i] = from.y;
      along_x[i] = to.x - from.x;
      along_y[i] = to.y - from.y;
    }
  }
};

/// The columns of a row that may lie in a triangle, a little too many.
struct Spans {
  double base[3], slope[3];  ///< the sides' columns at row 0, and columns per row along them
  bool left[3], right[3];    ///< which side of the triangle they are

  [[gnu::always_inline]] Spans(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                               const RowCorner& c) {
    const double p[3] = {column_of(samples, a), column_of(samples, b), column_of(samples, c)};
    const double q[3] = {row_of(samples, a), row_of(samples, b), row_of(samples, c)};
    for (int i = 0; i < 3; ++i) {
      const int next = i == 2 ? 0 : i + 1;
      const double down = q[next] - q[i];
      // A side towards higher rows is on the right, if the lattice is not mirrored. Of one along a
      // row rounding might decide.
      const bool flat = __builtin_fabs(down) < kFlat;
      left[i] = !flat && (down < 0.0) != samples.mirrored;
      right[i] = !flat && (down > 0.0) != samples.mirrored;
      slope[i] = flat ? 0.0 : (p[next] - p[i]) / down;
      base[i] = p[i] - slope[i] * q[i];
      // What samples are off the lattice, and what is rounded.
      const double steep = __builtin_fabs(slope[i]);
      const double margin =
          kColumnMargin + samples.off * (1.0 + steep) +
          0x1p-44 * (__builtin_fabs(p[i]) + steep * __builtin_fabs(q[i]) + steep * samples.rows);
      base[i] += left[i] ? -margin : margin;
    }
  }
  [[gnu::always_inline]] void row(std::int32_t row, std::int32_t& first, std::int32_t& last) const {
    double low = first, high = last;
    for (int i = 0; i < 3; ++i) {
      const double at = base[i] + slope[i] * row;
      low = left[i] ? greatest(low, at) : low;
      high = right[i] ? least(high, at) : high;
    }
    first = static_cast<std::int32_t>(low + (1.0 - kColumnMargin / 2));
    last = high < low ? first - 1 : static_cast<std::int32_t>(high);
  }
};

}  // namespace
}  // namespace terrace::tri::tin::rows
