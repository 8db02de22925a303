// SPDX-License-Identifier: Apache-2.0
#include <immintrin.h>

#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

/// A bit for each true lane.
[[gnu::always_inline]] inline unsigned bits_of(Ints16 mask) {
  __m256 halves[2];
  __builtin_memcpy(halves, &mask, sizeof mask);
  return static_cast<unsigned>(_mm256_movemask_ps(halves[0]) | _mm256_movemask_ps(halves[1]) << 8);
}
[[gnu::always_inline]] inline unsigned bits_of(Ints8 mask) {
  __m256d halves[2];
  __builtin_memcpy(halves, &mask, sizeof mask);
  return static_cast<unsigned>(_mm256_movemask_pd(halves[0]) | _mm256_movemask_pd(halves[1]) << 4);
}

}  // namespace
}  // namespace terrace::tri::tin

#include "scan_masks.hpp"

namespace terrace::tri::tin {

constinit const GridScan<float> kGridFloatsAvx2 = grid_scan<float>();
constinit const GridScan<double> kGridDoublesAvx2 = grid_scan<double>();
constinit const RowScans kRowScansAvx2 = {row_scan<false>(), row_scan<true>()};
constinit const CheckScans kCheckScansAvx2 = {check_in<float>, check_in<double>};

}  // namespace terrace::tri::tin
