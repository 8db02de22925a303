// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <immintrin.h>

#include "block/engine_impl.hpp"

/// Sixteen floats in one AVX-512 register. engine_portable.cpp describes the operations.

namespace terrace::cluster::simd {

struct Avx512 {
  struct Mask {
    __mmask16 lanes;
    [[nodiscard]] std::uint32_t bits() const { return lanes; }
    friend Mask operator&(Mask a, Mask b) { return {_kand_mask16(a.lanes, b.lanes)}; }
    friend Mask operator~(Mask m) { return {_knot_mask16(m.lanes)}; }
  };

  __m512 v;

  static Avx512 load(const float* source) { return {_mm512_loadu_ps(source)}; }
  static Avx512 load_integers(const std::uint32_t* source) {
    return {_mm512_cvtepi32_ps(_mm512_loadu_si512(source))};
  }
  static Avx512 broadcast(float value) { return {_mm512_set1_ps(value)}; }
  static Avx512 iota() {
    return {_mm512_setr_ps(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
  }
  void store(float* target) const { _mm512_storeu_ps(target, v); }
  void store_as_integers(std::uint32_t* target) const {
    _mm512_storeu_si512(target, _mm512_cvttps_epi32(v));
  }

  friend Avx512 operator+(Avx512 a, Avx512 b) { return {_mm512_add_ps(a.v, b.v)}; }
  friend Avx512 operator-(Avx512 a, Avx512 b) { return {_mm512_sub_ps(a.v, b.v)}; }
  friend Avx512 operator*(Avx512 a, Avx512 b) { return {_mm512_mul_ps(a.v, b.v)}; }
  friend Avx512 operator/(Avx512 a, Avx512 b) { return {_mm512_div_ps(a.v, b.v)}; }
  friend Avx512 min(Avx512 a, Avx512 b) { return {_mm512_min_ps(a.v, b.v)}; }
  friend Avx512 max(Avx512 a, Avx512 b) { return {_mm512_max_ps(a.v, b.v)}; }
  friend Avx512 sqrt(Avx512 a) { return {_mm512_sqrt_ps(a.v)}; }
  friend Mask less(Avx512 a, Avx512 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
  friend Mask equal(Avx512 a, Avx512 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)}; }
  friend Avx512 select(Mask m, Avx512 a, Avx512 b) {
    return {_mm512_mask_blend_ps(m.lanes, b.v, a.v)};
  }

  friend float sum(Avx512 a) {
    const __m256 eight = _mm256_add_ps(low(a), high(a));
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend float least(Avx512 a) {
    const __m256 eight = _mm256_min_ps(low(a), high(a));
    const __m128 four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend float largest(Avx512 a) {
    const __m256 eight = _mm256_max_ps(low(a), high(a));
    const __m128 four = _mm_max_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_max_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend void compress(float* target, Mask m, Avx512 a) {
    // Not the variant that stores to memory, which is microcoded on Zen 4.
    _mm512_storeu_ps(target, _mm512_maskz_compress_ps(m.lanes, a.v));
  }

 private:
  static __m256 low(Avx512 a) { return _mm512_castps512_ps256(a.v); }
  static __m256 high(Avx512 a) { return _mm512_extractf32x8_ps(a.v, 1); }
};

}  // namespace terrace::cluster::simd

namespace terrace::cluster {

void run_engine_avx512(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Avx512>(state).run(plan);
}

}  // namespace terrace::cluster
