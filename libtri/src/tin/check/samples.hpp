// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "tin/grid/path.hpp"

/// The inner loop of checks of TINs of rasters: the samples in a triangle against its plane.

namespace terrace::tri::tin {

inline constexpr int kCheckLanes = 8;

template <class T>
struct CheckWindow {
  const T* heights;
  /// One per sample and kCheckLanes more: 1 for those that were in a triangle.
  std::uint8_t* flags;
  std::int64_t columns, rows;
  double tolerance;
};

/// In lanes, as the order of sums is that of columns modulo the lanes.
struct CheckSums {
  double most[kCheckLanes] = {};
  double squares[kCheckLanes] = {};
  std::int64_t covered[kCheckLanes] = {};
};

/// A triangle that is counter-clockwise (columns to the right, rows upwards).
struct CheckTriangle {
  const double *a, *b, *c;  ///< column, row, height
  double area;              ///< twice
  double margin[3];         ///< of sides ab, bc, ca: the tolerance times their length
};

/// Takes the samples with data in a triangle, on its sides too, or outside by no more than the
/// tolerance. True: there are others, without data. All sets of functions give the same results,
/// bit by bit.
template <class T>
using CheckSamples = bool (*)(const CheckWindow<T>& window, const CheckTriangle& triangle,
                              CheckSums& sums);

template <class T>
CheckSamples<T> check_samples(GridPath path);  ///< of a supported path

bool check_float_portable(const CheckWindow<float>&, const CheckTriangle&, CheckSums&);
bool check_float_avx2(const CheckWindow<float>&, const CheckTriangle&, CheckSums&);
bool check_float_avx512(const CheckWindow<float>&, const CheckTriangle&, CheckSums&);
bool check_double_portable(const CheckWindow<double>&, const CheckTriangle&, CheckSums&);
bool check_double_avx2(const CheckWindow<double>&, const CheckTriangle&, CheckSums&);
bool check_double_avx512(const CheckWindow<double>&, const CheckTriangle&, CheckSums&);

}  // namespace terrace::tri::tin
