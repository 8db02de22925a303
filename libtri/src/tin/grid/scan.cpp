// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

namespace {

using Ints16 = std::int32_t __attribute__((vector_size(64)));
using Ints8 = std::int64_t __attribute__((vector_size(64)));

/// A bit for each lane that is true.
[[gnu::always_inline]] inline unsigned bits_of(Ints16 mask) {
  unsigned bits = 0;
  for (int i = 0; i < 16; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}
[[gnu::always_inline]] inline unsigned bits_of(Ints8 mask) {
  unsigned bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

}  // namespace

#include "scan_masks.hpp"

namespace terrace::tri::tin {

const GridScan<float> kGridScanFloatPortable{worst_in<float, 1>, worst_in<float, kGridCoarse>,
                                             within_in<float>};
const GridScan<double> kGridScanDoublePortable{worst_in<double, 1>, worst_in<double, kGridCoarse>,
                                               within_in<double>};

#ifdef TERRACE_TRI_X86

bool supported(GridPath path) {
  if (path == GridPath::kAvx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == GridPath::kAvx512)
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  return true;
}

template <>
const GridScan<float>& grid_scan(GridPath path) {
  return path == GridPath::kAvx512 ? kGridScanFloatAvx512
         : path == GridPath::kAvx2 ? kGridScanFloatAvx2
                                   : kGridScanFloatPortable;
}
template <>
const GridScan<double>& grid_scan(GridPath path) {
  return path == GridPath::kAvx512 ? kGridScanDoubleAvx512
         : path == GridPath::kAvx2 ? kGridScanDoubleAvx2
                                   : kGridScanDoublePortable;
}

#else

bool supported(GridPath path) { return path == GridPath::kPortable; }

template <>
const GridScan<float>& grid_scan(GridPath) {
  return kGridScanFloatPortable;
}
template <>
const GridScan<double>& grid_scan(GridPath) {
  return kGridScanDoublePortable;
}

#endif

GridPath best_grid_path() {
  static const GridPath best = supported(GridPath::kAvx512) ? GridPath::kAvx512
                               : supported(GridPath::kAvx2) ? GridPath::kAvx2
                                                            : GridPath::kPortable;
  return best;
}

}  // namespace terrace::tri::tin
