// SPDX-License-Identifier: Apache-2.0
#pragma once

// Included once for each instruction set, after what masks of lanes are there: type Mask, functions
// at_least(), above(), both(), either_of(), bits_of(). What is here must not be shared between
// objects, so nothing has a name outside its object, and no function of another header is called.
#include "scan_face.hpp"

namespace terrace::tri::tin::rows {
namespace {

/// Which samples lie in the triangle, rounding allowed for.
template <bool kUpright, class Edge>
[[gnu::always_inline]] inline auto inside(const Face<kUpright>& face, const Edge& edge) {
  const Reals margin = face.margin - Reals{};
  return both(at_least(edge(0), margin),
              both(at_least(edge(1), margin), at_least(edge(2), margin)));
}

/// Blocks of two rows of four samples, for boxes that are no wider. Calls visit(heights above the
/// plane, edge, column, row, log2 of the columns) until it returns false; edge(i) is the edge
/// function of side i.
template <bool kUpright, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const RowSamples& samples,
                                               const Face<kUpright>& face, const RowCorner& a,
                                               const Visit& visit) {
  const std::int32_t column = face.box.first_column;
  Reals x{}, across[3]{};
  if constexpr (kUpright) {
    x = load_two(samples.x + column, samples.x + column);
    for (int i = 0; i < 3; ++i) across[i] = face.along_y[i] * (x - face.start_x[i]);
  }
  for (std::int32_t row = face.box.first_row; row <= face.box.last_row; row += 2) {
    const std::size_t at =
        static_cast<std::size_t>(row) * samples.stride + static_cast<std::size_t>(column);
    const double* const z = samples.z + at;
    Reals y;
    if constexpr (kUpright) {
      const double upper = samples.y[row], lower = samples.y[row + 1];
      y = Reals{upper, upper, upper, upper, lower, lower, lower, lower};
    } else {
      x = load_two(samples.x + at, samples.x + at + samples.stride);
      y = load_two(samples.y + at, samples.y + at + samples.stride);
    }
    const Reals above_plane = (load_two(z, z + samples.stride) - a.z) -
                              (face.gradient_x * (x - a.x) + face.gradient_y * (y - a.y));
    const auto edge = [&](int i) __attribute__((always_inline)) {
      const Reals up = face.along_x[i] * (y - face.start_y[i]);
      if constexpr (kUpright) return up - across[i];
      return up - face.along_y[i] * (x - face.start_x[i]);
    };
    if (!visit(above_plane, edge, column, row, 2)) return;
  }
}

/// Row by row. Of wide triangles each row has its own range of columns.
template <bool kUpright, class Visit>
[[gnu::always_inline]] inline void scan_rows(const RowSamples& samples, const Face<kUpright>& face,
                                             const RowCorner& a, const RowCorner& b,
                                             const RowCorner& c, const Visit& visit) {
  const bool wide = face.box.last_column - face.box.first_column >= 2 * kLanes;
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
    for (std::int32_t column = first; column <= last; column += kLanes) {
      const std::size_t at = start + static_cast<std::size_t>(column);
      const Reals z = load(samples.z + at);
      Reals x, y{}, above_plane;
      if constexpr (kUpright) {
        x = load(samples.x + column);
        above_plane = (z - a.z) - (face.gradient_x * (x - a.x) + rise_y);
      } else {
        x = load(samples.x + at);
        y = load(samples.y + at);
        above_plane = (z - a.z) - (face.gradient_x * (x - a.x) + face.gradient_y * (y - a.y));
      }
      const auto edge = [&](int i) __attribute__((always_inline)) {
        const Reals side = face.along_y[i] * (x - face.start_x[i]);
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
RowWorst worst_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                  const RowCorner& c, double bound) {
  const Face<kUpright> face(samples, a, b, c);
  RowWorst worst{0, 0};
  if (face.empty) return worst;
  double best = greatest(bound - face.slack, face.slack);
  scan(
      samples, face, a, b, c,
      [&](Reals above_plane, const auto& edge, std::int32_t column, std::int32_t row, int bits)
          __attribute__((always_inline)) {
            const Reals error = size_of(above_plane);
            const auto candidates = above(error, best - Reals{});
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
      [&](Reals above_plane, const auto& edge, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            const auto candidates = above(size_of(above_plane), allowed - Reals{});
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
      [&](Reals above_plane, const auto& edge, std::int32_t column, std::int32_t row,
          int bits) __attribute__((always_inline)) {
        double* const to = errors + static_cast<std::size_t>(row) * samples.stride + column;
        const Reals sure = size_of(above_plane) + face.slack;
        const Reals known = bits == 2 ? load_two(to, to + samples.stride) : load(to);
        const Reals raised = either_of(both(above(sure, known), inside(face, edge)), sure, known);
        __builtin_memcpy(to, &raised, bits == 2 ? sizeof(Half) : sizeof(Reals));
        if (bits == 2)
          __builtin_memcpy(to + samples.stride, reinterpret_cast<const double*>(&raised) + 4,
                           sizeof(Half));
        return true;
      });
}

template <bool kUpright>
void narrow_in(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double bound, RowInterval& rises) {
  // Below this share of the weights the corner has no say.
  constexpr double kLeast = 1e-9;
  const Face<kUpright> face(samples, a, b, c);
  if (face.empty) return;
  const double allowed = greatest(bound - face.slack, 0.0);
  RowInterval found = rises;
  scan(
      samples, face, a, b, c,
      [&](Reals above_plane, const auto& edge, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            unsigned lanes = bits_of(inside(face, edge));
            if (lanes == 0) return true;
            const Reals weights = edge(1) * face.inverse;
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

constexpr RowScan scan_of() {
  return {{worst_in<false>, worst_in<true>},
          {within_in<false>, within_in<true>},
          {measure_in<false>, measure_in<true>},
          {narrow_in<false>, narrow_in<true>}};
}

}  // namespace
}  // namespace terrace::tri::tin::rows
