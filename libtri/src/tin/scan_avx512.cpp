// SPDX-License-Identifier: Apache-2.0
#include <immintrin.h>

#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

// Masks of lanes as in scan_masks.hpp, but in mask registers.

[[gnu::always_inline]] inline __mmask16 not_negative(Ints16 lanes) {
  return static_cast<__mmask16>(~_mm512_movepi32_mask((__m512i)lanes));
}
[[gnu::always_inline]] inline __mmask8 not_negative(Ints8 lanes) {
  return static_cast<__mmask8>(~_mm512_movepi64_mask((__m512i)lanes));
}
[[gnu::always_inline]] inline __mmask16 at_most(Ints16 a, Ints16 b) {
  return _mm512_cmple_epi32_mask((__m512i)a, (__m512i)b);
}
[[gnu::always_inline]] inline __mmask8 at_most(Ints8 a, Ints8 b) {
  return _mm512_cmple_epi64_mask((__m512i)a, (__m512i)b);
}
[[gnu::always_inline]] inline __mmask16 more(Ints16 a, Ints16 b) {
  return _mm512_cmpgt_epi32_mask((__m512i)a, (__m512i)b);
}
[[gnu::always_inline]] inline __mmask8 more(Ints8 a, Ints8 b) {
  return _mm512_cmpgt_epi64_mask((__m512i)a, (__m512i)b);
}
[[gnu::always_inline]] inline __mmask8 at_least(Reals8 a, Reals8 b) {
  return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GE_OQ);
}
[[gnu::always_inline]] inline __mmask8 above(Reals8 a, Reals8 b) {
  return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GT_OQ);
}
template <class Mask>
[[gnu::always_inline]] inline Mask mask_or(Mask a, Mask b) {
  return static_cast<Mask>(a | b);
}
template <class Mask>
[[gnu::always_inline]] inline Mask mask_and(Mask a, Mask b) {
  return static_cast<Mask>(a & b);
}
[[gnu::always_inline]] inline Ints16 blend(__mmask16 mask, Ints16 a, Ints16 b) {
  return (Ints16)_mm512_mask_mov_epi32((__m512i)b, mask, (__m512i)a);
}
[[gnu::always_inline]] inline Ints8 blend(__mmask8 mask, Ints8 a, Ints8 b) {
  return (Ints8)_mm512_mask_mov_epi64((__m512i)b, mask, (__m512i)a);
}
[[gnu::always_inline]] inline Reals8 blend(__mmask8 mask, Reals8 a, Reals8 b) {
  return (Reals8)_mm512_mask_mov_pd((__m512d)b, mask, (__m512d)a);
}
[[gnu::always_inline]] inline Reals16 zero_unless(Reals16 lanes, __mmask16 mask) {
  return (Reals16)_mm512_maskz_mov_ps(mask, (__m512)lanes);
}
[[gnu::always_inline]] inline Reals8 zero_unless(Reals8 lanes, __mmask8 mask) {
  return (Reals8)_mm512_maskz_mov_pd(mask, (__m512d)lanes);
}
[[gnu::always_inline]] inline unsigned exceeding(Reals16 lanes, Reals16 limit, __mmask16 mask) {
  return _mm512_mask_cmp_ps_mask(mask, (__m512)lanes, (__m512)limit, _CMP_NLE_UQ);
}
[[gnu::always_inline]] inline unsigned exceeding(Reals8 lanes, Reals8 limit, __mmask8 mask) {
  return _mm512_mask_cmp_pd_mask(mask, (__m512d)lanes, (__m512d)limit, _CMP_NLE_UQ);
}
[[gnu::always_inline]] inline unsigned equal(Ints16 a, Ints16 b) {
  return _mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b);
}
[[gnu::always_inline]] inline unsigned equal(Ints8 a, Ints8 b) {
  return _mm512_cmpeq_epi64_mask((__m512i)a, (__m512i)b);
}
template <class Mask>
[[gnu::always_inline]] inline unsigned bits_of(Mask mask) {
  return mask;
}

}  // namespace
}  // namespace terrace::tri::tin

#include "scan_impl.hpp"

namespace terrace::tri::tin {

constinit const GridScan<float> kGridFloatsAvx512 = grid_scan<float>();
constinit const GridScan<double> kGridDoublesAvx512 = grid_scan<double>();
constinit const RowScans kRowScansAvx512 = {row_scan<false>(), row_scan<true>()};
constinit const CheckScans kCheckScansAvx512 = {check_in<float>, check_in<double>};

}  // namespace terrace::tri::tin
