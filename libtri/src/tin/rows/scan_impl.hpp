// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan.hpp"
#include "tin/scan_lanes.hpp"

namespace terrace::tri::tin::rows {
namespace {

using L = Lanes<double>;

constexpr double kColumnMargin = 0.01;
constexpr double kFlat = 1e-6;

/// The first of `count` ascending places that is not below `from`.
[[gnu::always_inline]] inline std::int32_t first_not_below(const double* places, std::int32_t count,
                                                           double per_unit, double from) {
  const double guess =
      least(greatest((from - places[0]) * per_unit, 0.0), static_cast<double>(count));
  auto at = static_cast<std::int32_t>(guess);
  while (places[at] < from) ++at;
  while (places[at - 1] >= from) --at;
  return at;
}
/// The first of `count` ascending places that is above `to`.
[[gnu::always_inline]] inline std::int32_t first_above(const double* places, std::int32_t count,
                                                       double per_unit, double to) {
  const double guess =
      least(greatest((to - places[0]) * per_unit + 1.0, 0.0), static_cast<double>(count));
  auto at = static_cast<std::int32_t>(guess);
  while (places[at] <= to) ++at;
  while (places[at - 1] > to) --at;
  return at;
}

/// A box of the lattice, slightly too large if samples are only approximately regular.
struct Box {
  std::int32_t first_column, last_column, first_row, last_row;
};

/// The box of the samples between places.
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

/// Rounds up and down to integers from -1 to `count`.
[[gnu::always_inline]] inline std::int32_t whole_from(double low, std::int32_t count) {
  const double kept = least(greatest(low, 0.0), static_cast<double>(count));
  const auto down = static_cast<std::int32_t>(kept);
  return down + (static_cast<double>(down) < kept ? 1 : 0);
}
[[gnu::always_inline]] inline std::int32_t whole_to(double high, std::int32_t count) {
  return static_cast<std::int32_t>(least(greatest(high, -1.0), static_cast<double>(count - 1)) +
                                   1.0) -
         1;
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
  double inverse;  ///< reciprocal of twice the area
  double slack;    ///< bound of the rounding error of an error
  double margin;   ///< bound of the rounding error of an edge function, negated
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
    // Rounding errors come from the gradients (several times, in proportion to the terms of their
    // sums), from 2 products, from differences of places and heights, and from 2 sums.
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

/// The columns of a row that may be in a triangle, slightly too many.
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
      // A side towards higher rows is on the right unless the lattice is mirrored. Rounding might
      // decide for a side along a row, so such a side is ignored.
      const bool flat = __builtin_fabs(down) < kFlat;
      left[i] = !flat && (down < 0.0) != samples.mirrored;
      right[i] = !flat && (down > 0.0) != samples.mirrored;
      slope[i] = flat ? 0.0 : (p[next] - p[i]) / down;
      base[i] = p[i] - slope[i] * q[i];
      // The samples' deviation from the lattice, plus rounding.
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

/// The mask of samples that are in the triangle, or so close to it that rounding decides.
template <bool kUpright, class Edge>
[[gnu::always_inline]] inline auto inside(const Face<kUpright>& face, const Edge& edge) {
  const Reals8 margin = face.margin - Reals8{};
  return both(at_least(edge(0), margin),
              both(at_least(edge(1), margin), at_least(edge(2), margin)));
}

/// Visits blocks of two rows of four samples, for boxes that are no wider. Calls visit(heights
/// above the plane, edge, column, row, log2 of the columns) until it returns false; edge(i) is the
/// edge function of side i.
template <bool kUpright, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const RowSamples& samples,
                                               const Face<kUpright>& face, const RowCorner& a,
                                               const Visit& visit) {
  const std::int32_t column = face.box.first_column;
  Reals8 x{}, across[3]{};
  if constexpr (kUpright) {
    x = L::load_halves(samples.x + column, samples.x + column);
    for (int i = 0; i < 3; ++i) across[i] = face.along_y[i] * (x - face.start_x[i]);
  }
  for (std::int32_t row = face.box.first_row; row <= face.box.last_row; row += 2) {
    const std::size_t at =
        static_cast<std::size_t>(row) * samples.stride + static_cast<std::size_t>(column);
    const double* const z = samples.z + at;
    Reals8 y;
    if constexpr (kUpright) {
      const double upper = samples.y[row], lower = samples.y[row + 1];
      y = Reals8{upper, upper, upper, upper, lower, lower, lower, lower};
    } else {
      x = L::load_halves(samples.x + at, samples.x + at + samples.stride);
      y = L::load_halves(samples.y + at, samples.y + at + samples.stride);
    }
    const Reals8 above_plane = (L::load_halves(z, z + samples.stride) - a.z) -
                               (face.gradient_x * (x - a.x) + face.gradient_y * (y - a.y));
    const auto edge = [&](int i) __attribute__((always_inline)) {
      const Reals8 up = face.along_x[i] * (y - face.start_y[i]);
      if constexpr (kUpright) return up - across[i];
      return up - face.along_y[i] * (x - face.start_x[i]);
    };
    if (!visit(above_plane, edge, column, row, 2)) return;
  }
}

/// Visits the samples row by row. In wide triangles each row has its own range of columns.
template <bool kUpright, class Visit>
[[gnu::always_inline]] inline void scan_rows(const RowSamples& samples, const Face<kUpright>& face,
                                             const RowCorner& a, const RowCorner& b,
                                             const RowCorner& c, const Visit& visit) {
  const bool wide = face.box.last_column - face.box.first_column >= 2 * L::kLanes;
  const Spans spans(samples, a, b, c);
  for (std::int32_t row = face.box.first_row; row <= face.box.last_row; ++row) {
    std::int32_t first = face.box.first_column, last = face.box.last_column;
    if (wide) spans.row(row, first, last);
    const std::size_t start = static_cast<std::size_t>(row) * samples.stride;
    double up[3]{}, rise_y = 0.0;
    if constexpr (kUpright) {
      const double y = samples.y[row];
      for (int i = 0; i < 3; ++i) up[i] = face.along_x[i] * (y - face.start_y[i]);
      rise_y = face.gradient_y * (y - a.y);
    }
    for (std::int32_t column = first; column <= last; column += L::kLanes) {
      const std::size_t at = start + static_cast<std::size_t>(column);
      const Reals8 z = L::load(samples.z + at);
      Reals8 x, y{}, above_plane;
      if constexpr (kUpright) {
        x = L::load(samples.x + column);
        above_plane = (z - a.z) - (face.gradient_x * (x - a.x) + rise_y);
      } else {
        x = L::load(samples.x + at);
        y = L::load(samples.y + at);
        above_plane = (z - a.z) - (face.gradient_x * (x - a.x) + face.gradient_y * (y - a.y));
      }
      const auto edge = [&](int i) __attribute__((always_inline)) {
        const Reals8 side = face.along_y[i] * (x - face.start_x[i]);
        if constexpr (kUpright) return up[i] - side;
        return face.along_x[i] * (y - face.start_y[i]) - side;
      };
      if (!visit(above_plane, edge, column, row, 3)) return;
    }
  }
}

template <bool kUpright, class Visit>
[[gnu::always_inline]] inline void scan(const RowSamples& samples, const Face<kUpright>& face,
                                        const RowCorner& a, const RowCorner& b, const RowCorner& c,
                                        const Visit& visit) {
  if (face.box.last_column - face.box.first_column < 4) {
    scan_blocks(samples, face, a, visit);
  } else {
    scan_rows(samples, face, a, b, c, visit);
  }
}

template <bool kUpright>
WorstSample<double> worst_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                             const RowCorner& c, double bound) {
  const Face<kUpright> face(samples, a, b, c);
  WorstSample<double> worst{0, 0};
  if (face.empty) return worst;
  double best = greatest(bound - face.slack, face.slack);
  scan(
      samples, face, a, b, c,
      [&](Reals8 above_plane, const auto& edge, std::int32_t column, std::int32_t row, int bits)
          __attribute__((always_inline)) {
            const Reals8 error = L::absolute(above_plane);
            const auto candidates = above(error, best - Reals8{});
            if (bits_of(candidates) == 0) return true;
            unsigned found = bits_of(both(candidates, inside(face, edge)));
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

template <bool kUpright>
bool within_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double bound) {
  const Face<kUpright> face(samples, a, b, c);
  if (face.empty) return true;
  const double allowed = greatest(bound - face.slack, face.slack);
  bool within = true;
  scan(
      samples, face, a, b, c,
      [&](Reals8 above_plane, const auto& edge, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            const auto candidates = above(L::absolute(above_plane), allowed - Reals8{});
            if (bits_of(candidates) == 0) return true;
            within = bits_of(both(candidates, inside(face, edge))) == 0;
            return within;
          });
  return within;
}

template <bool kUpright>
void measure_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                const RowCorner& c, double* errors) {
  const Face<kUpright> face(samples, a, b, c);
  if (face.empty) return;
  scan(
      samples, face, a, b, c,
      [&](Reals8 above_plane, const auto& edge, std::int32_t column, std::int32_t row, int bits)
          __attribute__((always_inline)) {
            double* const to = errors + static_cast<std::size_t>(row) * samples.stride + column;
            const Reals8 sure = L::absolute(above_plane) + face.slack;
            const Reals8 known = bits == 2 ? L::load_halves(to, to + samples.stride) : L::load(to);
            const Reals8 raised = chosen(both(above(sure, known), inside(face, edge)), sure, known);
            __builtin_memcpy(to, &raised, bits == 2 ? sizeof(L::Half) : sizeof(Reals8));
            if (bits == 2)
              __builtin_memcpy(to + samples.stride, reinterpret_cast<const double*>(&raised) + 4,
                               sizeof(L::Half));
            return true;
          });
}

template <bool kUpright>
void narrow_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double bound, Interval& rises) {
  // Samples where the corner has a smaller weight are ignored.
  constexpr double kLeast = 1e-9;
  const Face<kUpright> face(samples, a, b, c);
  if (face.empty) return;
  const double allowed = greatest(bound - face.slack, 0.0);
  Interval found = rises;
  scan(
      samples, face, a, b, c,
      [&](Reals8 above_plane, const auto& edge, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            unsigned lanes = bits_of(inside(face, edge));
            if (lanes == 0) return true;
            const Reals8 weights = edge(1) * face.inverse;
            for (; lanes != 0; lanes &= lanes - 1) {
              const int lane = __builtin_ctz(lanes);
              const double weight = weights[lane], rise = above_plane[lane];
              if (!(weight > kLeast) || rise != rise) continue;
              found.low = greatest(found.low, (rise - allowed) / weight);
              found.high = least(found.high, (rise + allowed) / weight);
            }
            return true;
          });
  rises = found;
}

template <bool kUpright>
constexpr RowScan row_scan() {
  return {worst_in<kUpright>, within_in<kUpright>, measure_in<kUpright>, narrow_in<kUpright>};
}

}  // namespace
}  // namespace terrace::tri::tin::rows
