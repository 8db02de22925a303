// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loop of TINs of samples in rows and columns whose vertices stand beside the samples.

namespace terrace::tri::tin::rows {

/// A vertex.
struct RowCorner {
  double x, y, z;
};

/// Samples by rows: after each row are at least kRowPad numbers, and a row after the last. NaN: no
/// sample.
struct RowSamples {
  /// Upright: the places of columns and rows, ascending; x[-1] and y[-1] are -infinity, and after
  /// the last are at least kRowPad places at infinity. Else of all samples, as the heights.
  const double* x;
  const double* y;
  const double* z;
  std::size_t stride;  ///< from row to row
  std::int32_t columns, rows;
  bool upright;
  bool mirrored;  ///< rows are to the right of columns
  /// About the column of a place: column_0 + column_x * x + column_y * y. The row likewise.
  double column_0, column_x, column_y;
  double row_0, row_x, row_y;
  double off;  ///< of columns and rows that are found so, at most
};
inline constexpr std::size_t kRowPad = 8;

struct RowWorst {
  double error;
  std::uint32_t place;  ///< row << 16 | column
};

/// An interval of numbers.
struct RowInterval {
  double low, high;
};

/// Errors are those of a triangle's plane at the samples in it, sides included. Next to a side,
/// where rounding decides, samples count to the triangles on both sides of it. What rounding may do
/// to an error is on the safe side. One set of functions for each instruction set; all give the
/// same results, bit by bit.
struct RowScan {
  /// The sample with the greatest error of those that may be above `bound`; of equal ones the first
  /// in its row, of the first row. Error 0: there is none.
  RowWorst worst(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                 const RowCorner& c, double bound) const {
    return worst_[samples.upright](samples, a, b, c, bound);
  }
  /// Whether all errors are certainly at most `bound`.
  bool within(const RowSamples& samples, const RowCorner& a, const RowCorner& b, const RowCorner& c,
              double bound) const {
    return within_[samples.upright](samples, a, b, c, bound);
  }
  /// Raises each sample's number in `errors`, an array like that of the heights, to its error.
  void measure(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
               const RowCorner& c, double* errors) const {
    measure_[samples.upright](samples, a, b, c, errors);
  }
  /// Narrows `rises` to what corner a may rise by (or sink, below 0) so that no error is above
  /// `bound`, nearly.
  void narrow(const RowSamples& samples, const RowCorner& a, const RowCorner& b, const RowCorner& c,
              double bound, RowInterval& rises) const {
    narrow_[samples.upright](samples, a, b, c, bound, rises);
  }

  RowWorst (*worst_[2])(const RowSamples&, const RowCorner&, const RowCorner&, const RowCorner&,
                        double);
  bool (*within_[2])(const RowSamples&, const RowCorner&, const RowCorner&, const RowCorner&,
                     double);
  void (*measure_[2])(const RowSamples&, const RowCorner&, const RowCorner&, const RowCorner&,
                      double*);
  void (*narrow_[2])(const RowSamples&, const RowCorner&, const RowCorner&, const RowCorner&,
                     double, RowInterval&);
};

enum class RowPath : std::uint8_t { kPortable, kAvx2, kAvx512 };
bool supported(RowPath path);
const RowScan& row_scan(RowPath path);  ///< of a supported path
RowPath best_row_path();

extern const RowScan kRowScanPortable, kRowScanAvx2, kRowScanAvx512;

}  // namespace terrace::tri::tin::rows
