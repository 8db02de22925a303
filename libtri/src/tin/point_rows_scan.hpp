// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loop of TINs of samples in rows and columns whose vertices stand beside the samples.

namespace terrace::tri::tin::rows {

/// A vertex.
struct RowCorner {
  double x, y, z;
};

/// Samples by rows. x[-1] and y[-1] are -infinity; after the last column and row there are at least
/// kRowPad places at infinity, after each row of heights as many values, and a row after the last.
/// NaN: no sample.
struct RowSamples {
  const double* x;  ///< of columns, ascending, at about equal distances
  const double* y;  ///< of rows, likewise
  const double* z;
  std::size_t stride;  ///< of z
  std::int32_t columns, rows;
  double columns_per_x, rows_per_y;
};
inline constexpr std::size_t kRowPad = 8;

struct RowWorst {
  double error;
  std::uint32_t place;  ///< row << 16 | column
};

/// Errors are those of a triangle's plane at the samples in it, sides included. Next to a side,
/// where rounding decides, samples count to the triangles on both sides of it. What rounding may do
/// to an error is on the safe side. One set of functions for each instruction set; all give the
/// same results, bit by bit.
struct RowScan {
  /// The sample with the greatest error of those that may be above `bound`; of equal ones the first
  /// in its row, of the first row. Error 0: there is none.
  RowWorst (*worst)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                    const RowCorner& c, double bound);
  /// Whether all errors are certainly at most `bound`.
  bool (*within)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                 const RowCorner& c, double bound);
  /// Raises each sample's number in `errors`, an array like that of the heights, to its error.
  void (*measure)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                  const RowCorner& c, double* errors);
};

enum class RowPath : std::uint8_t { kPortable, kAvx2, kAvx512 };
bool supported(RowPath path);
const RowScan& row_scan(RowPath path);  ///< of a supported path
RowPath best_row_path();

extern const RowScan kRowScanPortable, kRowScanAvx2, kRowScanAvx512;

}  // namespace terrace::tri::tin::rows
