// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::base {

/// The instruction sets for which inner loops are compiled. All compute the same bits.
enum class SimdPath : std::uint8_t {
  automatic,  ///< the best one that the processor supports
  portable,   ///< the baseline of the architecture
  avx2,
  avx512,  ///< AVX-512 F, DQ and VL
};

/// Returns whether this processor can run the loops of that path.
[[nodiscard]] inline bool supports(SimdPath path) {
#if defined(__x86_64__) && defined(__GNUC__)
  if (path == SimdPath::avx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == SimdPath::avx512) {
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
           __builtin_cpu_supports("avx512vl") != 0;
  }
#endif
  return path == SimdPath::automatic || path == SimdPath::portable;
}

/// Returns the best path that this processor supports; never `automatic`.
[[nodiscard]] inline SimdPath best_simd_path() {
  static const SimdPath best = supports(SimdPath::avx512) ? SimdPath::avx512
                               : supports(SimdPath::avx2) ? SimdPath::avx2
                                                          : SimdPath::portable;
  return best;
}

}  // namespace terrace::base
