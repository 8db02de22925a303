// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

namespace {

constexpr std::size_t kLanes = 2;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Mask = std::int64_t __attribute__((vector_size(kLanes * sizeof(double))));

/// A bit for each lane that is true.
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

bool supported(ScanPath path) {
  if (path == ScanPath::kAvx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == ScanPath::kAvx512)
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  return true;
}

ScanFunction scan_function(ScanPath path) {
  return path == ScanPath::kAvx512 ? scan_avx512
         : path == ScanPath::kAvx2 ? scan_avx2
                                   : scan_portable;
}

#else

bool supported(ScanPath path) { return path == ScanPath::kPortable; }

ScanFunction scan_function(ScanPath) { return scan_portable; }

#endif

ScanFunction best_scan_function() {
  static const ScanFunction best =
      scan_function(supported(ScanPath::kAvx512) ? ScanPath::kAvx512
                    : supported(ScanPath::kAvx2) ? ScanPath::kAvx2
                                                 : ScanPath::kPortable);
  return best;
}

}  // namespace terrace::tri::spatial
