// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <immintrin.h>

#include "block/engine_impl.hpp"

/// Sixteen floats in two AVX2 registers. engine_portable.cpp describes the operations.

namespace terrace::cluster::simd {

/// For each set of eight lanes, the permutation that moves them to the front.
struct CompressTable {
  alignas(32) std::uint32_t order[256][8] = {};
  constexpr CompressTable() {
    for (unsigned set = 0; set < 256; ++set) {
      unsigned position = 0;
      for (unsigned lane = 0; lane < 8; ++lane) {
        if (((set >> lane) & 1u) != 0) order[set][position++] = lane;
      }
    }
  }
};
inline constexpr CompressTable kCompress;

struct Avx2 {
  struct Mask {
    __m256 low, high;
    [[nodiscard]] std::uint32_t bits() const {
      return static_cast<std::uint32_t>(_mm256_movemask_ps(low)) |
             static_cast<std::uint32_t>(_mm256_movemask_ps(high)) << 8;
    }
    friend Mask operator&(Mask a, Mask b) {
      return {_mm256_and_ps(a.low, b.low), _mm256_and_ps(a.high, b.high)};
    }
    friend Mask operator~(Mask m) {
      const __m256 ones = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
      return {_mm256_xor_ps(m.low, ones), _mm256_xor_ps(m.high, ones)};
    }
  };

  __m256 low, high;

  static Avx2 load(const float* source) {
    return {_mm256_loadu_ps(source), _mm256_loadu_ps(source + 8)};
  }
  static Avx2 load_integers(const std::uint32_t* source) {
    const auto* const eight = reinterpret_cast<const __m256i*>(source);
    return {_mm256_cvtepi32_ps(_mm256_loadu_si256(eight)),
            _mm256_cvtepi32_ps(_mm256_loadu_si256(eight + 1))};
  }
  static Avx2 broadcast(float value) { return {_mm256_set1_ps(value), _mm256_set1_ps(value)}; }
  static Avx2 iota() {
    return {_mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7), _mm256_setr_ps(8, 9, 10, 11, 12, 13, 14, 15)};
  }
  void store(float* target) const {
    _mm256_storeu_ps(target, low);
    _mm256_storeu_ps(target + 8, high);
  }
  void store_as_integers(std::uint32_t* target) const {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(target), _mm256_cvttps_epi32(low));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(target + 8), _mm256_cvttps_epi32(high));
  }

  friend Avx2 operator+(Avx2 a, Avx2 b) {
    return {_mm256_add_ps(a.low, b.low), _mm256_add_ps(a.high, b.high)};
  }
  friend Avx2 operator-(Avx2 a, Avx2 b) {
    return {_mm256_sub_ps(a.low, b.low), _mm256_sub_ps(a.high, b.high)};
  }
  friend Avx2 operator*(Avx2 a, Avx2 b) {
    return {_mm256_mul_ps(a.low, b.low), _mm256_mul_ps(a.high, b.high)};
  }
  friend Avx2 operator/(Avx2 a, Avx2 b) {
    return {_mm256_div_ps(a.low, b.low), _mm256_div_ps(a.high, b.high)};
  }
  friend Avx2 min(Avx2 a, Avx2 b) {
    return {_mm256_min_ps(a.low, b.low), _mm256_min_ps(a.high, b.high)};
  }
  friend Avx2 max(Avx2 a, Avx2 b) {
    return {_mm256_max_ps(a.low, b.low), _mm256_max_ps(a.high, b.high)};
  }
  friend Avx2 sqrt(Avx2 a) { return {_mm256_sqrt_ps(a.low), _mm256_sqrt_ps(a.high)}; }
  friend Mask less(Avx2 a, Avx2 b) {
    return {_mm256_cmp_ps(a.low, b.low, _CMP_LT_OQ), _mm256_cmp_ps(a.high, b.high, _CMP_LT_OQ)};
  }
  friend Mask equal(Avx2 a, Avx2 b) {
    return {_mm256_cmp_ps(a.low, b.low, _CMP_EQ_OQ), _mm256_cmp_ps(a.high, b.high, _CMP_EQ_OQ)};
  }
  friend Avx2 select(Mask m, Avx2 a, Avx2 b) {
    return {_mm256_blendv_ps(b.low, a.low, m.low), _mm256_blendv_ps(b.high, a.high, m.high)};
  }

  friend float sum(Avx2 a) {
    const __m256 eight = _mm256_add_ps(a.low, a.high);
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend float least(Avx2 a) {
    const __m256 eight = _mm256_min_ps(a.low, a.high);
    const __m128 four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend float largest(Avx2 a) {
    const __m256 eight = _mm256_max_ps(a.low, a.high);
    const __m128 four = _mm_max_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_max_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
  friend void compress(float* target, Mask m, Avx2 a) {
    const auto first = static_cast<unsigned>(_mm256_movemask_ps(m.low));
    const auto second = static_cast<unsigned>(_mm256_movemask_ps(m.high));
    _mm256_storeu_ps(target, compressed(a.low, first));
    _mm256_storeu_ps(target + __builtin_popcount(first), compressed(a.high, second));
  }

 private:
  /// Returns the lanes of the set, moved to the front.
  static __m256 compressed(__m256 value, unsigned set) {
    const auto* order = reinterpret_cast<const __m256i*>(kCompress.order[set]);
    return _mm256_permutevar8x32_ps(value, _mm256_load_si256(order));
  }
};

}  // namespace terrace::cluster::simd

namespace terrace::cluster {

void run_engine_avx2(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Avx2>(state).run(plan);
}

}  // namespace terrace::cluster
