// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "tin/scan_results.hpp"

/// The inner loops of TINs of samples in rows and columns whose vertices may differ in position
/// from the samples.

namespace terrace::tri::tin::rows {

struct RowCorner {
  double x, y, z;
};

/// Samples row by row, with at least kRowPad values after each row and one more row after the last.
/// NaN marks a missing sample.
struct RowSamples {
  /// If `upright`, the places of columns and rows, ascending; x[-1] and y[-1] are -infinity, and at
  /// least kRowPad places at infinity follow the last. Otherwise the places of all samples, laid
  /// out like z.
  const double* x;
  const double* y;
  const double* z;
  std::size_t stride;  ///< values from row to row
  std::int32_t columns, rows;
  bool upright;
  bool mirrored;  ///< true if columns and rows form a left-handed system
  /// The approximate column of a place is column_0 + column_x * x + column_y * y; the row likewise.
  double column_0, column_x, column_y;
  double row_0, row_x, row_y;
  double off;  ///< the largest error of such a column or row
};
inline constexpr std::size_t kRowPad = 8;

/// Errors are differences between a triangle's plane and the samples in it, including its sides.
/// Samples so close to a side that rounding decides belong to the triangles on both sides of it.
/// Rounding errors are added, never ignored.
struct RowScan {
  /// Finds the sample with the greatest error that may be above `bound`; on ties the first in the
  /// first row. The error is 0 if there is none.
  WorstSample<double> (*worst)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                               const RowCorner& c, double bound);
  /// Returns true if all errors are certainly at most `bound`.
  bool (*within)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                 const RowCorner& c, double bound);
  /// Raises each sample's entry in `errors`, laid out like the heights, to its error.
  void (*measure)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                  const RowCorner& c, double* errors);
  /// Narrows `rises` to the range by which corner a may rise such that, up to rounding, no error
  /// exceeds `bound`.
  void (*narrow)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                 const RowCorner& c, double bound, Interval& rises);
};

}  // namespace terrace::tri::tin::rows
