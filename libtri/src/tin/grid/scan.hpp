// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "tin/scan_results.hpp"

/// The inner loops of TINs of rasters: compare the samples in a triangle with its plane.

namespace terrace::tri::tin {

/// A vertex on the lattice.
template <class T>
struct GridCorner {
  std::int32_t x;  ///< column
  std::int32_t y;  ///< row
  T z;
};

/// Samples, row by row, with at least kScanPadRight values after each row and kScanPadBelow rows
/// after the last one. NaN marks missing data. Only columns and rows from `first` to `last` are
/// scanned.
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
  /// that may exceed `bound`; on ties the first in the first row. The error is 0 if there is none,
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

}  // namespace terrace::tri::tin
