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

constinit const Scans kScansAvx2 = all_scans();

}  // namespace terrace::tri::tin
