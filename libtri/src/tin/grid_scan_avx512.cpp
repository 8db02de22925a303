// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace {

using Mask16 = std::int32_t __attribute__((vector_size(64)));
using Mask8 = std::int64_t __attribute__((vector_size(64)));

/// A bit for each lane that is true.
[[gnu::always_inline]] inline unsigned bits_of(Mask16 mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask));
}
[[gnu::always_inline]] inline unsigned bits_of(Mask8 mask) {
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(mask));
}

}  // namespace

#include "grid_scan_impl.hpp"

namespace terrace::tri::tin {

const GridScan<float> kGridScanFloatAvx512{worst_in<float>, most_in<float>};
const GridScan<double> kGridScanDoubleAvx512{worst_in<double>, most_in<double>};

}  // namespace terrace::tri::tin
