// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace {

using Ints = std::int64_t __attribute__((vector_size(64)));
using Reals = double __attribute__((vector_size(64)));

// Masks of lanes; as point_rows_scan_masks.hpp, in registers of their own.

[[gnu::always_inline]] inline __mmask8 at_least(Reals a, Reals b) {
  return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GE_OQ);
}
[[gnu::always_inline]] inline __mmask8 above(Reals a, Reals b) {
  return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GT_OQ);
}
[[gnu::always_inline]] inline __mmask8 both(__mmask8 a, __mmask8 b) {
  return static_cast<__mmask8>(a & b);
}
[[gnu::always_inline]] inline Reals either_of(__mmask8 mask, Reals a, Reals b) {
  return (Reals)_mm512_mask_mov_pd((__m512d)b, mask, (__m512d)a);
}
[[gnu::always_inline]] inline unsigned bits_of(__mmask8 mask) { return mask; }

}  // namespace

#include "scan_impl.hpp"

namespace terrace::tri::tin::rows {

const RowScan kRowScanAvx512 = scan_of();

}  // namespace terrace::tri::tin::rows
