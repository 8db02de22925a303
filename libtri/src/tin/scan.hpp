// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <terrace/base/simd.hpp>

/// The inner loops of meshing and checking: compare the samples in a triangle with its plane. Each
/// is compiled for several instruction sets, which give bit-identical results.

namespace terrace::tri::tin {

template <class T>
struct WorstSample {
  T error;
  std::uint32_t place;  ///< row << 16 | column
};

/// The range by which a vertex may rise (negative: sink).
struct Interval {
  double low = -__builtin_inf();
  double high = __builtin_inf();
};

/// A vertex on the lattice of a raster.
template <class T>
struct GridCorner {
  std::int32_t x;  ///< column
  std::int32_t y;  ///< row
  T z;
};

/// Samples of a raster, row by row, with at least kScanPadRight values after each row and
/// kScanPadBelow rows after the last one. NaN marks missing data. Only columns and rows from
/// `first` to `last` are scanned.
template <class T>
struct GridSamples {
  const T* heights;
  std::size_t stride;
  std::int32_t first_x, first_y;
  std::int32_t last_x, last_y;
};
inline constexpr std::size_t kScanPadRight = 16;
inline constexpr std::size_t kScanPadBelow = 4;
inline constexpr int kGridCoarse = 4;

/// Returned in place of an error if T is not precise enough for this triangle and bound. T = float
/// only.
inline constexpr int kUnsure = -1;

template <class T>
struct GridScan {
  /// Finds the sample in the triangle (including sides, excluding corners) with the greatest error
  /// that may exceed `bound`, on ties the first in the first row. The error is 0 if there is none,
  /// and infinite, without a place, if a sample has no data.
  WorstSample<T> (*worst)(const GridSamples<T>& samples, const GridCorner<T>& a,
                          const GridCorner<T>& b, const GridCorner<T>& c, T bound);
  /// The same for `samples` that are every kGridCoarse-th column and row of the lattice and are
  /// numbered accordingly. Corners and the result are in columns and rows of the lattice.
  WorstSample<T> (*coarse)(const GridSamples<T>& samples, const GridCorner<T>& a,
                           const GridCorner<T>& b, const GridCorner<T>& c, T bound);
  /// Returns 1 if all errors are certainly at most `bound`, 0 if perhaps not or data is missing, or
  /// kUnsure.
  int (*within)(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
                const GridCorner<T>& c, T bound);
};

struct RowCorner {
  double x, y, z;
};

/// Samples in rows and columns at given places, row by row, with at least kRowPad values after each
/// row and one more row after the last. NaN marks a missing sample.
struct RowSamples {
  /// If `upright`, the places of columns and rows, ascending. x[-1] and y[-1] are -infinity, and at
  /// least kRowPad places at infinity follow the last. Otherwise the places of all samples, laid
  /// out like z.
  const double* x;
  const double* y;
  const double* z;
  std::size_t stride;  ///< values from row to row
  std::int32_t columns, rows;
  bool upright;
  bool mirrored;  ///< true if columns and rows form a left-handed system
  /// The approximate column of a place is column_0 + column_x * x + column_y * y. The row is
  /// computed likewise.
  double column_0, column_x, column_y;
  double row_0, row_x, row_y;
  double deviation;  ///< the largest error of such a column or row
};
inline constexpr std::size_t kRowPad = 8;

/// Vertices may differ in position from the samples. Errors are differences between a triangle's
/// plane and the samples in it, including its sides. Samples so close to a side that rounding
/// decides belong to the triangles on both sides of it. Rounding errors are added, never ignored.
struct RowScan {
  /// Finds the sample with the greatest error that may be above `bound`, on ties the first in the
  /// first row. The error is 0 if there is none.
  WorstSample<double> (*worst)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                               const RowCorner& c, double bound);
  /// Returns 1 if all errors are certainly at most `bound`, otherwise 0.
  int (*within)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                const RowCorner& c, double bound);
  /// Raises each sample's entry in `errors`, laid out like the heights, to its error.
  void (*measure)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                  const RowCorner& c, double* errors);
  /// Narrows `rises` to the range by which corner a may rise such that, up to rounding, no error
  /// exceeds `bound`.
  void (*narrow)(const RowSamples& samples, const RowCorner& a, const RowCorner& b,
                 const RowCorner& c, double bound, Interval& rises);
};

inline constexpr int kCheckLanes = 8;

/// A raster whose TIN is checked.
template <class T>
struct CheckWindow {
  const T* heights;
  /// One flag per sample plus kCheckLanes more: 1 if the sample is in some triangle.
  std::uint8_t* flags;
  std::int64_t columns, rows;
  double tolerance;
};

/// One sum per lane, so that the order of summation is the same for all instruction sets.
struct CheckSums {
  double max_error[kCheckLanes] = {};
  double squares[kCheckLanes] = {};
  std::int64_t covered[kCheckLanes] = {};
};

/// A triangle that is counter-clockwise (columns to the right, rows upwards).
struct CheckTriangle {
  const double *a, *b, *c;  ///< column, row, height
  double area;              ///< twice the area
  double margin[3];         ///< for sides ab, bc, ca: the tolerance times their length
};

/// Adds the samples with data that are in a triangle, on its sides or outside it by no more than
/// the tolerance. Returns true if there are also samples without data.
template <class T>
using CheckScan = bool (*)(const CheckWindow<T>& window, const CheckTriangle& triangle,
                           CheckSums& sums);

struct CheckScans {
  CheckScan<float> floats;
  CheckScan<double> doubles;

  template <class T>
  CheckScan<T> of() const {
    if constexpr (std::is_same_v<T, float>) return floats;
    if constexpr (std::is_same_v<T, double>) return doubles;
  }
};
using RowScans = RowScan[2];  ///< by RowSamples::upright

/// The scans for one instruction set, which must be supported. Each use has its own table, so that
/// a program links only those that it uses.
template <class T>
const GridScan<T>& grid_scans(base::SimdPath set);
template <>
const GridScan<float>& grid_scans(base::SimdPath set);
template <>
const GridScan<double>& grid_scans(base::SimdPath set);
const RowScans& row_scans(base::SimdPath set);
const CheckScans& check_scans(base::SimdPath set);

extern const GridScan<float> kGridFloatsPortable, kGridFloatsAvx2, kGridFloatsAvx512;
extern const GridScan<double> kGridDoublesPortable, kGridDoublesAvx2, kGridDoublesAvx512;
extern const RowScans kRowScansPortable, kRowScansAvx2, kRowScansAvx512;
extern const CheckScans kCheckScansPortable, kCheckScansAvx2, kCheckScansAvx512;

}  // namespace terrace::tri::tin
