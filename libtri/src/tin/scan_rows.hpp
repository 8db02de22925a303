// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan_triangle.hpp"

namespace terrace::tri::tin {
namespace {

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

[[gnu::always_inline]] inline double column_of(const RowSamples& samples, const RowCorner& p) {
  return samples.column_0 + (samples.column_x * p.x + samples.column_y * p.y);
}
[[gnu::always_inline]] inline double row_of(const RowSamples& samples, const RowCorner& p) {
  return samples.row_0 + (samples.row_x * p.x + samples.row_y * p.y);
}

/// Rounds up to an integer from 0 to `count`.
[[gnu::always_inline]] inline std::int32_t clamped_ceiling(double low, std::int32_t count) {
  const double clamped = least(greatest(low, 0.0), static_cast<double>(count));
  const auto down = static_cast<std::int32_t>(clamped);
  return down + (static_cast<double>(down) < clamped ? 1 : 0);
}
/// Rounds down to an integer from -1 to `count - 1`.
[[gnu::always_inline]] inline std::int32_t clamped_floor(double high, std::int32_t count) {
  return static_cast<std::int32_t>(least(greatest(high, -1.0), static_cast<double>(count - 1)) +
                                   1.0) -
         1;
}

/// A triangle over samples at given places. Samples so close to a side that rounding decides are
/// inside.
template <bool kUpright>
struct RowFace {
  using Real = double;
  using L = Lanes<double>;
  static constexpr int kWidestBlock = 4;

  const RowSamples& samples;
  const RowCorner &a, &b, &c;
  std::int32_t first_column, last_column, first_row, last_row;
  bool empty;
  double gradient_x, gradient_y;
  double inverse;  ///< reciprocal of twice the area
  double slack;
  double margin;  ///< bound of the rounding error of an edge function, negated
  double start_x[3], start_y[3], along_x[3], along_y[3];  ///< start and direction of the sides

  [[gnu::always_inline]] RowFace(const RowSamples& all, const RowCorner& p, const RowCorner& q,
                                 const RowCorner& r, double = 0.0)
      : samples(all), a(p), b(q), c(r) {
    const double min_x = least(a.x, least(b.x, c.x)), max_x = greatest(a.x, greatest(b.x, c.x));
    const double min_y = least(a.y, least(b.y, c.y)), max_y = greatest(a.y, greatest(b.y, c.y));
    if constexpr (kUpright) {
      first_column = first_not_below(samples.x, samples.columns, samples.column_x, min_x);
      last_column = first_above(samples.x, samples.columns, samples.column_x, max_x) - 1;
      first_row = first_not_below(samples.y, samples.rows, samples.row_y, min_y);
      last_row = first_above(samples.y, samples.rows, samples.row_y, max_y) - 1;
    } else {
      range_around(column_of(samples, a), column_of(samples, b), column_of(samples, c),
                   samples.columns, first_column, last_column);
      range_around(row_of(samples, a), row_of(samples, b), row_of(samples, c), samples.rows,
                   first_row, last_row);
    }
    empty = first_row > last_row || first_column > last_column;
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
  /// A range of the lattice that contains all samples between these positions.
  [[gnu::always_inline]] void range_around(double p, double q, double r, std::int32_t count,
                                           std::int32_t& first, std::int32_t& last) const {
    first = clamped_ceiling(least(p, least(q, r)) - samples.deviation, count);
    last = clamped_floor(greatest(p, greatest(q, r)) + samples.deviation, count);
  }

  /// Edge functions, which are evaluated only where errors require it. edge(i) is that of side i.
  template <class Edge>
  struct Sides {
    const Edge& edge;
    double margin;
    [[gnu::always_inline]] auto inside() const {
      const Reals8 least_inside = margin - Reals8{};
      return mask_and(at_least(edge(0), least_inside),
                      mask_and(at_least(edge(1), least_inside), at_least(edge(2), least_inside)));
    }
  };

  /// NaN, a missing sample, is not beyond any limit.
  template <class Sides>
  [[gnu::always_inline]] static bool any_beyond(Reals8 error, Reals8 limit, const Sides& sides) {
    const auto candidates = above(error, limit);
    return bits_of(candidates) != 0 && bits_of(mask_and(candidates, sides.inside())) != 0;
  }

  template <int kWidth>
  struct Blocks {
    static_assert(kWidth == 4);
    const RowFace& face;
    Reals8 x{}, across[3]{};

    [[gnu::always_inline]] explicit Blocks(const RowFace& of) : face(of) {
      if constexpr (kUpright) {
        x = L::load_halves(face.samples.x + face.first_column, face.samples.x + face.first_column);
        for (int i = 0; i < 3; ++i) across[i] = face.along_y[i] * (x - face.start_x[i]);
      }
    }

    template <class Visit>
    [[gnu::always_inline]] bool visit(std::int32_t row, const Visit& visitor) {
      const RowSamples& samples = face.samples;
      const std::size_t at = static_cast<std::size_t>(row) * samples.stride +
                             static_cast<std::size_t>(face.first_column);
      const double* const z = samples.z + at;
      Reals8 y;
      if constexpr (kUpright) {
        const double upper = samples.y[row], lower = samples.y[row + 1];
        y = Reals8{upper, upper, upper, upper, lower, lower, lower, lower};
      } else {
        x = L::load_halves(samples.x + at, samples.x + at + samples.stride);
        y = L::load_halves(samples.y + at, samples.y + at + samples.stride);
      }
      const Reals8 above_plane =
          (L::load_halves(z, z + samples.stride) - face.a.z) -
          (face.gradient_x * (x - face.a.x) + face.gradient_y * (y - face.a.y));
      const auto edge = [&](int i) __attribute__((always_inline)) {
        const Reals8 up = face.along_x[i] * (y - face.start_y[i]);
        if constexpr (kUpright) return up - across[i];
        return up - face.along_y[i] * (x - face.start_x[i]);
      };
      return visitor(above_plane, Sides<decltype(edge)>{edge, face.margin}, face.first_column, row,
                     kWidth);
    }
  };

  /// In wide triangles each row has its own range of columns, slightly too large.
  struct Rows {
    const RowFace& face;
    double base[3], slope[3];  ///< the sides' columns at row 0, and columns per row along them
    bool left[3], right[3];    ///< which side of the triangle they are
    std::int32_t first, last, row;
    std::size_t from;
    double up[3]{}, rise_y = 0.0;

    [[gnu::always_inline]] explicit Rows(const RowFace& of) : face(of) {
      const RowSamples& samples = face.samples;
      const double p[3] = {column_of(samples, face.a), column_of(samples, face.b),
                           column_of(samples, face.c)};
      const double q[3] = {row_of(samples, face.a), row_of(samples, face.b),
                           row_of(samples, face.c)};
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
        const double deviation =
            kColumnMargin + samples.deviation * (1.0 + steep) +
            0x1p-44 * (__builtin_fabs(p[i]) + steep * __builtin_fabs(q[i]) + steep * samples.rows);
        base[i] += left[i] ? -deviation : deviation;
      }
    }

    [[gnu::always_inline]] void start(std::int32_t at) {
      row = at;
      first = face.first_column, last = face.last_column;
      if (last - first >= 2 * L::kLanes) {
        double low = first, high = last;
        for (int i = 0; i < 3; ++i) {
          const double side = base[i] + slope[i] * row;
          low = left[i] ? greatest(low, side) : low;
          high = right[i] ? least(high, side) : high;
        }
        first = static_cast<std::int32_t>(low + (1.0 - kColumnMargin / 2));
        last = high < low ? first - 1 : static_cast<std::int32_t>(high);
      }
      from = static_cast<std::size_t>(row) * face.samples.stride;
      if constexpr (kUpright) {
        const double y = face.samples.y[row];
        for (int i = 0; i < 3; ++i) up[i] = face.along_x[i] * (y - face.start_y[i]);
        rise_y = face.gradient_y * (y - face.a.y);
      }
    }

    template <class Visit>
    [[gnu::always_inline]] bool visit(std::int32_t column, const Visit& visitor) const {
      const RowSamples& samples = face.samples;
      const std::size_t at = from + static_cast<std::size_t>(column);
      const Reals8 z = L::load(samples.z + at);
      Reals8 x, y{}, above_plane;
      if constexpr (kUpright) {
        x = L::load(samples.x + column);
        above_plane = (z - face.a.z) - (face.gradient_x * (x - face.a.x) + rise_y);
      } else {
        x = L::load(samples.x + at);
        y = L::load(samples.y + at);
        above_plane =
            (z - face.a.z) - (face.gradient_x * (x - face.a.x) + face.gradient_y * (y - face.a.y));
      }
      const auto edge = [&](int i) __attribute__((always_inline)) {
        const Reals8 side = face.along_y[i] * (x - face.start_x[i]);
        if constexpr (kUpright) return up[i] - side;
        return face.along_x[i] * (y - face.start_y[i]) - side;
      };
      return visitor(above_plane, Sides<decltype(edge)>{edge, face.margin}, column, row, L::kLanes);
    }
  };
};

template <bool kUpright>
WorstSample<double> worst_of_rows(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                                  const RowCorner& c, double bound) {
  const RowFace<kUpright> face(samples, a, b, c);
  WorstSample<double> worst{0, 0};
  if (face.empty) return worst;
  double best = greatest_allowed(bound, face.slack);
  scan_triangle(
      face, [&](Reals8 above_plane, const auto& sides, std::int32_t column, std::int32_t row,
                int width) __attribute__((always_inline)) {
        const Reals8 error = Lanes<double>::absolute(above_plane);
        const auto candidates = above(error, best - Reals8{});
        if (bits_of(candidates) == 0) return true;
        unsigned found = bits_of(mask_and(candidates, sides.inside()));
        for (; found != 0; found &= found - 1) {
          const int lane = __builtin_ctz(found);
          if (!(error[lane] > best)) continue;
          best = error[lane];
          worst = {best, static_cast<std::uint32_t>(row + (lane / width)) << 16 |
                             static_cast<std::uint32_t>(column + (lane & (width - 1)))};
        }
        return true;
      });
  return worst;
}

template <bool kUpright>
void measure_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                const RowCorner& c, double* errors) {
  const RowFace<kUpright> face(samples, a, b, c);
  if (face.empty) return;
  scan_triangle(
      face, [&](Reals8 above_plane, const auto& sides, std::int32_t column, std::int32_t row,
                int width) __attribute__((always_inline)) {
        double* const to = errors + static_cast<std::size_t>(row) * samples.stride + column;
        const Reals8 sure = Lanes<double>::absolute(above_plane) + face.slack;
        const Reals8 known = width == 4 ? Lanes<double>::load_halves(to, to + samples.stride)
                                        : Lanes<double>::load(to);
        const Reals8 raised = blend(mask_and(above(sure, known), sides.inside()), sure, known);
        __builtin_memcpy(to, &raised, width == 4 ? sizeof(Lanes<double>::Half) : sizeof(Reals8));
        if (width == 4)
          __builtin_memcpy(to + samples.stride, reinterpret_cast<const double*>(&raised) + 4,
                           sizeof(Lanes<double>::Half));
        return true;
      });
}

template <bool kUpright>
void narrow_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double bound, Interval& rises) {
  // Samples where the corner has a smaller weight are ignored.
  constexpr double kMinWeight = 1e-9;
  const RowFace<kUpright> face(samples, a, b, c);
  if (face.empty) return;
  const double allowed = greatest(bound - face.slack, 0.0);
  Interval found = rises;
  scan_triangle(
      face, [&](Reals8 above_plane, const auto& sides, std::int32_t, std::int32_t, int)
                __attribute__((always_inline)) {
                  unsigned lanes = bits_of(sides.inside());
                  if (lanes == 0) return true;
                  const Reals8 weights = sides.edge(1) * face.inverse;
                  for (; lanes != 0; lanes &= lanes - 1) {
                    const int lane = __builtin_ctz(lanes);
                    const double weight = weights[lane], rise = above_plane[lane];
                    if (!(weight > kMinWeight) || rise != rise) continue;
                    found.low = greatest(found.low, (rise - allowed) / weight);
                    found.high = least(found.high, (rise + allowed) / weight);
                  }
                  return true;
                });
  rises = found;
}

template <bool kUpright>
constexpr RowScan row_scan() {
  return {worst_of_rows<kUpright>, within_in<RowFace<kUpright>, RowSamples, RowCorner>,
          measure_in<kUpright>, narrow_in<kUpright>};
}

}  // namespace
}  // namespace terrace::tri::tin
