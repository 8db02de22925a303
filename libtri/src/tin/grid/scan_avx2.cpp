// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace {

using Ints16 = std::int32_t __attribute__((vector_size(64)));
using Ints8 = std::int64_t __attribute__((vector_size(64)));

/// A bit for each lane that is true.
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

#include "scan_masks.hpp"

namespace terrace::tri::tin {

const GridScan<float> kGridScanFloatAvx2{worst_in<float, 1>, worst_in<float, kGridCoarse>,
                                         within_in<float>};
const GridScan<double> kGridScanDoubleAvx2{worst_in<double, 1>, worst_in<double, kGridCoarse>,
                                           within_in<double>};

}  // namespace terrace::tri::tin
