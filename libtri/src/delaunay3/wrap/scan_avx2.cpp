// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace {

constexpr std::size_t kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Mask = std::int64_t __attribute__((vector_size(kLanes * sizeof(double))));

/// A bit for each true lane.
[[gnu::always_inline]] inline unsigned bits_of(Mask mask) {
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
}

}  // namespace

#include "scan_impl.hpp"

namespace terrace::tri::spatial {

std::size_t scan_avx2(const ScanVertices& vertices, const ScanFacet& facet, std::uint32_t* near) {
  return scan_with_lanes(vertices, facet, near);
}

}  // namespace terrace::tri::spatial
