// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace {

using Ints = std::int64_t __attribute__((vector_size(64)));

/// A bit for each lane that is true.
[[gnu::always_inline]] inline unsigned bits_of(Ints mask) {
  __m256d halves[2];
  __builtin_memcpy(halves, &mask, sizeof mask);
  return static_cast<unsigned>(_mm256_movemask_pd(halves[0]) | _mm256_movemask_pd(halves[1]) << 4);
}

}  // namespace

#include "scan_masks.hpp"

namespace terrace::tri::tin::rows {

const RowScan kRowScanAvx2 = scan_of();

}  // namespace terrace::tri::tin::rows
