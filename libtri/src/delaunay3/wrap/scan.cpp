// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include <terrace/base/simd.hpp>

namespace {

constexpr std::size_t kLanes = 2;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Mask = std::int64_t __attribute__((vector_size(kLanes * sizeof(double))));

/// A bit for each true lane.
[[gnu::always_inline]] inline unsigned bits_of(Mask mask) {
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
}

}  // namespace

#include "scan_impl.hpp"

namespace terrace::tri::spatial {

std::size_t scan_portable(const ScanVertices& vertices, const ScanFacet& facet,
                          std::uint32_t* near) {
  return scan_with_lanes(vertices, facet, near);
}

#ifdef TERRACE_TRI_X86
ScanFunction scan_function(base::SimdPath set) {
  return set == base::SimdPath::avx512 ? scan_avx512
         : set == base::SimdPath::avx2 ? scan_avx2
                                       : scan_portable;
}
#else
ScanFunction scan_function(base::SimdPath) { return scan_portable; }
#endif

}  // namespace terrace::tri::spatial
