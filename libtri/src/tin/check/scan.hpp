// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loop of checking TINs of rasters: compares the samples in a triangle with its plane.

namespace terrace::tri::tin {

inline constexpr int kCheckLanes = 8;

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
  double most[kCheckLanes] = {};
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

}  // namespace terrace::tri::tin
