// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan.hpp"
#include "scan_lanes.hpp"

// Compares the samples in a triangle with its plane, a vector of samples at a time. GridFace and
// RowFace, the faces, hold a triangle of samples of one kind:
// - Real: the type of errors. empty: no sample can exceed the bound. slack: bound of the rounding
//   error of an error.
// - first_column, last_column, first_row, last_row: a box around the samples in the triangle.
// - kWidestBlock: boxes of at most this many columns are visited in blocks of 4 columns, 8, and so
//   on, which may span several rows; wider ones row by row.
// - Blocks<kWidth>(face).visit(row, visit): visits the block at the row. Called for each in turn.
// - Rows(face).start(row): gives the row's columns as `first` and `last`. visit(column, visit).
//
// Vectors are visited by visit(above_plane, sides, column, row, width). `above_plane`: heights of
// the samples above the plane. sides.inside(): the mask of those in the triangle. The samples
// are in `width` columns, and in as many rows as fill the vector, from this column and row.

namespace terrace::tri::tin {
namespace {

/// The greatest error that is within the bound despite rounding. kUnsure if T is not precise enough
/// for this triangle.
template <class T>
[[gnu::always_inline]] inline T greatest_allowed(T bound, T slack) {
  if constexpr (std::is_same_v<T, float>) return slack <= bound * 0x1p-8F ? bound - slack : kUnsure;
  return greatest(bound - slack, slack);
}

template <int kWidth, class Face, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const Face& face, const Visit& visit) {
  typename Face::template Blocks<kWidth> blocks(face);
  for (std::int32_t row = face.first_row; row <= face.last_row;
       row += Lanes<typename Face::Real>::kLanes / kWidth)
    if (!blocks.visit(row, visit)) return;
}

template <class Face, class Visit>
[[gnu::always_inline]] inline void scan_rows(const Face& face, const Visit& visit) {
  typename Face::Rows rows(face);
  for (std::int32_t row = face.first_row; row <= face.last_row; ++row) {
    rows.start(row);
    for (std::int32_t column = rows.first; column <= rows.last;
         column += Lanes<typename Face::Real>::kLanes)
      if (!rows.visit(column, visit)) return;
  }
}

/// Visits the samples until a visit returns false.
template <class Face, class Visit>
[[gnu::always_inline]] inline void scan_triangle(const Face& face, const Visit& visit) {
  const std::int32_t width = face.last_column - face.first_column + 1;
  if (width <= 4) return scan_blocks<4>(face, visit);
  if constexpr (Face::kWidestBlock >= 8)
    if (width <= 8) return scan_blocks<8>(face, visit);
  if constexpr (Face::kWidestBlock >= 16)
    if (width <= 16) return scan_blocks<16>(face, visit);
  scan_rows(face, visit);
}

/// Face::any_beyond(errors, limit, sides): true if a sample in the triangle has a greater error.
template <class Face, class Samples, class Corner>
int within_in(const Samples& samples, const Corner& a, const Corner& b, const Corner& c,
              typename Face::Real bound) {
  using K = Lanes<typename Face::Real>;
  using Reals = typename K::Reals;
  const Face face(samples, a, b, c, bound);
  if (face.empty) return 1;
  const auto allowed = greatest_allowed(bound, face.slack);
  if (allowed == kUnsure) return kUnsure;
  bool within = true;
  scan_triangle(
      face, [&](Reals above_plane, const auto& sides, std::int32_t, std::int32_t, int)
                __attribute__((always_inline)) {
                  within = !Face::any_beyond(K::absolute(above_plane), allowed - Reals{}, sides);
                  return within;
                });
  return within ? 1 : 0;
}

}  // namespace
}  // namespace terrace::tri::tin
