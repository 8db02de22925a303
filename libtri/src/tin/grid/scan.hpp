// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "path.hpp"

/// The inner loop of TINs of rasters: the samples in a triangle against its plane.

namespace terrace::tri::tin {

/// A vertex on the lattice.
template <class T>
struct GridCorner {
  std::int32_t x;  ///< column
  std::int32_t y;  ///< row
  T z;
};

/// Samples, row by row, with at least kScanPadRight values after each row and kScanPadBelow rows
/// after the last one. NaN: no data. Only columns and rows from `first` to `last` are looked at.
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

template <class T>
struct GridWorst {
  T error;
  std::uint32_t place;  ///< row << 16 | column
};
/// Errors in place of errors: the samples' type is not precise enough for this triangle and bound;
/// only T = float says so.
inline constexpr int kUnsure = -1;

/// One set of functions for each instruction set; all give the same results, bit by bit.
template <class T>
struct GridScan {
  /// The sample with the greatest error of those in the triangle (sides included, corners not) that
  /// may exceed `bound`; of equal ones the first in its row, of the first row. Error 0: there is
  /// none. Infinite: there is a sample without data; the place is any.
  GridWorst<T> (*worst)(const GridSamples<T>& samples, const GridCorner<T>& a,
                        const GridCorner<T>& b, const GridCorner<T>& c, T bound);
  /// The same of samples that are every kGridCoarse-th column and row of the lattice, from its
  /// first on. `samples` counts these; corners and the result have columns and rows of the lattice.
  GridWorst<T> (*coarse)(const GridSamples<T>& samples, const GridCorner<T>& a,
                         const GridCorner<T>& b, const GridCorner<T>& c, T bound);
  /// 1: all errors are certainly at most `bound`; 0: perhaps not, or data is missing; or kUnsure.
  int (*within)(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
                const GridCorner<T>& c, T bound);
};

template <class T>
const GridScan<T>& grid_scan(GridPath path);  ///< of a supported path

extern const GridScan<float> kGridScanFloatPortable, kGridScanFloatAvx2, kGridScanFloatAvx512;
extern const GridScan<double> kGridScanDoublePortable, kGridScanDoubleAvx2, kGridScanDoubleAvx512;

}  // namespace terrace::tri::tin
