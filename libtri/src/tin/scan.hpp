// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include <terrace/base/simd.hpp>

#include "check/scan.hpp"
#include "grid/scan.hpp"
#include "rows/scan.hpp"

namespace terrace::tri::tin {

/// The scans for one instruction set. All sets give bit-identical results.
struct Scans {
  GridScan<float> grid_floats;
  GridScan<double> grid_doubles;
  rows::RowScan rows[2];  ///< by RowSamples::upright
  CheckScan<float> check_floats;
  CheckScan<double> check_doubles;

  template <class T>
  const GridScan<T>& grid() const {
    if constexpr (std::is_same_v<T, float>) return grid_floats;
    if constexpr (std::is_same_v<T, double>) return grid_doubles;
  }
  template <class T>
  CheckScan<T> check() const {
    if constexpr (std::is_same_v<T, float>) return check_floats;
    if constexpr (std::is_same_v<T, double>) return check_doubles;
  }
};
const Scans& scans(base::SimdPath set);  ///< requires a supported set

extern const Scans kScansPortable, kScansAvx2, kScansAvx512;

}  // namespace terrace::tri::tin
