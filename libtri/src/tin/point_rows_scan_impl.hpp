// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Included once for each instruction set, after what masks of lanes are there: type Mask, functions
// at_least(), above(), both(), either_of(), bits_of(). What is here must not be shared between
// objects, so nothing has a name outside its object, and no function of another header is called.
#include "point_rows_scan.hpp"

namespace terrace::tri::tin::rows {
namespace {

using Half = double __attribute__((vector_size(32)));
constexpr int kLanes = 8;
constexpr double kColumnMargin = 0.01;

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

/// What a scan knows of its triangle before it looks at samples.
struct Face {
  double gradient_x, gradient_y;
  double slack;   ///< what rounding may do to an error
  double margin;  ///< what it may do to an edge function, negative
  double start_x[3], start_y[3], along_x[3], along_y[3];  ///< of the sides
  std::int32_t first_column, last_column, first_row, last_row;
  bool empty;

  [[gnu::always_inline]] Face(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                              const RowCorner& c) {
    const double min_x = least(a.x, least(b.x, c.x)), max_x = greatest(a.x, greatest(b.x, c.x));
    const double min_y = least(a.y, least(b.y, c.y)), max_y = greatest(a.y, greatest(b.y, c.y));
    first_row = first_not_below(samples.y, samples.rows, samples.rows_per_y, min_y);
    last_row = first_above(samples.y, samples.rows, samples.rows_per_y, max_y) - 1;
    first_column = first_not_below(samples.x, samples.columns, samples.columns_per_x, min_x);
    last_column = first_above(samples.x, samples.columns, samples.columns_per_x, max_x) - 1;
    empty = first_row > last_row || first_column > last_column;
    if (empty) return;
    const double bx = b.x - a.x, by = b.y - a.y, bz = b.z - a.z;
    const double cx = c.x - a.x, cy = c.y - a.y, cz = c.z - a.z;
    const double inverse = 1.0 / (bx * cy - by * cx);
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

/// Blocks of two rows of four samples, for boxes that are no wider. Calls visit(errors, inside(),
/// column, row, log2 of the columns) until it returns false.
template <class Visit>
[[gnu::always_inline]] inline void scan_blocks(const RowSamples& samples, const Face& face,
                                               const RowCorner& a, const Visit& visit) {
  const std::int32_t column = face.first_column;
  const Reals x = load_two(samples.x + column, samples.x + column);
  const Reals rise_x = face.gradient_x * (x - a.x);
  Reals across[3];
  for (int i = 0; i < 3; ++i) across[i] = face.along_y[i] * (x - face.start_x[i]);
  for (std::int32_t row = face.first_row; row <= face.last_row; row += 2) {
    const double* const z = samples.z + static_cast<std::size_t>(row) * samples.stride + column;
    const double upper = samples.y[row], lower = samples.y[row + 1];
    const Reals y = {upper, upper, upper, upper, lower, lower, lower, lower};
    const Reals error =
        size_of((load_two(z, z + samples.stride) - a.z) - (rise_x + face.gradient_y * (y - a.y)));
    const auto inside = [&]() __attribute__((always_inline)) {
      Reals edge[3];
      for (int i = 0; i < 3; ++i) edge[i] = face.along_x[i] * (y - face.start_y[i]) - across[i];
      return both(
          at_least(edge[0], face.margin - Reals{}),
          both(at_least(edge[1], face.margin - Reals{}), at_least(edge[2], face.margin - Reals{})));
    };
    if (!visit(error, inside, column, row, 2)) return;
  }
}

/// Row by row. Of wide triangles each row has its own range of columns, a little too wide.
template <class Visit>
[[gnu::always_inline]] inline void scan_rows(const RowSamples& samples, const Face& face,
                                             const RowCorner& a, const Visit& visit) {
  const bool wide = face.last_column - face.first_column >= 2 * kLanes;
  // The columns of the sides' starts, and columns per height along the sides.
  double base[3], slope[3];
  for (int i = 0; i < 3 && wide; ++i) {
    const double sign = face.along_y[i] < 0.0 ? -1.0 : 1.0;
    slope[i] =
        face.along_y[i] == 0.0 ? 0.0 : face.along_x[i] / face.along_y[i] * samples.columns_per_x;
    base[i] = (face.start_x[i] - samples.x[0]) * samples.columns_per_x;
    // Places are off equal distances by less than that, and quotients are rounded.
    base[i] += sign * (kColumnMargin +
                       0x1p-48 * (__builtin_fabs(base[i]) +
                                  __builtin_fabs(face.along_x[i]) * samples.columns_per_x));
  }
  for (std::int32_t row = face.first_row; row <= face.last_row; ++row) {
    const double y = samples.y[row];
    std::int32_t first = face.first_column, last = face.last_column;
    double across[3];
    for (int i = 0; i < 3; ++i) across[i] = face.along_x[i] * (y - face.start_y[i]);
    if (wide) {
      double left = first, right = last;
      for (int i = 0; i < 3; ++i) {
        const double at = base[i] + slope[i] * (y - face.start_y[i]);
        // A side that goes down is on the left.
        left = face.along_y[i] < 0.0 ? greatest(left, at) : left;
        right = face.along_y[i] > 0.0 ? least(right, at) : right;
      }
      if (right < left) continue;
      first = static_cast<std::int32_t>(left + (1.0 - kColumnMargin / 2));
      last = static_cast<std::int32_t>(right);
    }
    const double* const z = samples.z + static_cast<std::size_t>(row) * samples.stride;
    const double rise_y = face.gradient_y * (y - a.y);
    for (std::int32_t column = first; column <= last; column += kLanes) {
      const Reals x = load(samples.x + column);
      const Reals error =
          size_of((load(z + column) - a.z) - (face.gradient_x * (x - a.x) + rise_y));
      const auto inside = [&]() __attribute__((always_inline)) {
        Reals edge[3];
        for (int i = 0; i < 3; ++i) edge[i] = across[i] - face.along_y[i] * (x - face.start_x[i]);
        return both(at_least(edge[0], face.margin - Reals{}),
                    both(at_least(edge[1], face.margin - Reals{}),
                         at_least(edge[2], face.margin - Reals{})));
      };
      if (!visit(error, inside, column, row, 3)) return;
    }
  }
}

template <class Visit>
[[gnu::always_inline]] inline void scan(const RowSamples& samples, const Face& face,
                                        const RowCorner& a, const Visit& visit) {
  if (face.last_column - face.first_column < 4) {
    scan_blocks(samples, face, a, visit);
  } else {
    scan_rows(samples, face, a, visit);
  }
}

RowWorst worst_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                  const RowCorner& c, double bound) {
  const Face face(samples, a, b, c);
  RowWorst worst{0, 0};
  if (face.empty) return worst;
  double best = greatest(bound - face.slack, face.slack);
  scan(
      samples, face, a,
      [&](Reals error, const auto& inside, std::int32_t column, std::int32_t row, int bits)
          __attribute__((always_inline)) {
            const auto candidates = above(error, best - Reals{});
            if (bits_of(candidates) == 0) return true;
            unsigned found = bits_of(both(candidates, inside()));
            for (; found != 0; found &= found - 1) {
              const int lane = __builtin_ctz(found);
              if (!(error[lane] > best)) continue;
              best = error[lane];
              worst = {best, static_cast<std::uint32_t>(row + (lane >> bits)) << 16 |
                                 static_cast<std::uint32_t>(column + (lane & ((1 << bits) - 1)))};
            }
            return true;
          });
  return worst;
}

bool within_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double bound) {
  const Face face(samples, a, b, c);
  if (face.empty) return true;
  const double allowed = greatest(bound - face.slack, face.slack);
  bool within = true;
  scan(
      samples, face, a,
      [&](Reals error, const auto& inside, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            const auto candidates = above(error, allowed - Reals{});
            if (bits_of(candidates) == 0) return true;
            within = bits_of(both(candidates, inside())) == 0;
            return within;
          });
  return within;
}

void measure_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                const RowCorner& c, double* errors) {
  const Face face(samples, a, b, c);
  if (face.empty) return;
  scan(
      samples, face, a,
      [&](Reals error, const auto& inside, std::int32_t column, std::int32_t row, int bits)
          __attribute__((always_inline)) {
            double* const to = errors + static_cast<std::size_t>(row) * samples.stride + column;
            const Reals sure = error + face.slack;
            const Reals known = bits == 2 ? load_two(to, to + samples.stride) : load(to);
            const Reals raised = either_of(both(above(sure, known), inside()), sure, known);
            __builtin_memcpy(to, &raised, bits == 2 ? sizeof(Half) : sizeof(Reals));
            if (bits == 2)
              __builtin_memcpy(to + samples.stride, reinterpret_cast<const double*>(&raised) + 4,
                               sizeof(Half));
            return true;
          });
}

}  // namespace
}  // namespace terrace::tri::tin::rows
