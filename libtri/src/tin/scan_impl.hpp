// SPDX-License-Identifier: Apache-2.0
#pragma once

// Includes all scans. The includer must first define the functions on masks of lanes:
// not_negative(), at_most(), more(), at_least(), above(), either(), both(), chosen(), kept(),
// beyond(), equal(), bits_of().
#include "check/scan_impl.hpp"
#include "grid/scan_impl.hpp"
#include "rows/scan_impl.hpp"
#include "scan.hpp"

namespace terrace::tri::tin {
namespace {

template <class T>
constexpr GridScan<T> grid_scan() {
  return {worst_in<T, 1>, worst_in<T, kGridCoarse>, within_in<T>};
}

constexpr Scans all_scans() {
  return {grid_scan<float>(),
          grid_scan<double>(),
          {rows::row_scan<false>(), rows::row_scan<true>()},
          check_in<float>,
          check_in<double>};
}

}  // namespace
}  // namespace terrace::tri::tin
