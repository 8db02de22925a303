// SPDX-License-Identifier: Apache-2.0
#include "assignment/scan_kernels.hpp"

#include <type_traits>

namespace terrace::matching {

extern const ScanKernels<double> kScanDoublePortable, kScanDoubleAvx2, kScanDoubleAvx512;
extern const ScanKernels<float> kScanFloatPortable, kScanFloatAvx2, kScanFloatAvx512;
extern const ScanKernels<std::int32_t> kScanIntPortable, kScanIntAvx2, kScanIntAvx512;

bool has_scan_path([[maybe_unused]] ScanPath path) {
#ifdef TERRACE_MATCHING_X86
  if (path == ScanPath::avx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == ScanPath::avx512) {
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
           __builtin_cpu_supports("avx512vl") != 0;
  }
#endif
  return path == ScanPath::portable;
}

template <class Cost>
const ScanKernels<Cost>& scan_kernels([[maybe_unused]] ScanPath path) {
  if constexpr (std::is_same_v<Cost, double>) {
#ifdef TERRACE_MATCHING_X86
    if (path == ScanPath::avx512) return kScanDoubleAvx512;
    if (path == ScanPath::avx2) return kScanDoubleAvx2;
#endif
    return kScanDoublePortable;
  } else if constexpr (std::is_same_v<Cost, float>) {
#ifdef TERRACE_MATCHING_X86
    if (path == ScanPath::avx512) return kScanFloatAvx512;
    if (path == ScanPath::avx2) return kScanFloatAvx2;
#endif
    return kScanFloatPortable;
  } else {
#ifdef TERRACE_MATCHING_X86
    if (path == ScanPath::avx512) return kScanIntAvx512;
    if (path == ScanPath::avx2) return kScanIntAvx2;
#endif
    return kScanIntPortable;
  }
}

template <class Cost>
const ScanKernels<Cost>& scan_kernels() {
  static const ScanPath best = has_scan_path(ScanPath::avx512) ? ScanPath::avx512
                               : has_scan_path(ScanPath::avx2) ? ScanPath::avx2
                                                               : ScanPath::portable;
  return scan_kernels<Cost>(best);
}

template const ScanKernels<double>& scan_kernels();
template const ScanKernels<float>& scan_kernels();
template const ScanKernels<std::int32_t>& scan_kernels();
template const ScanKernels<double>& scan_kernels(ScanPath);
template const ScanKernels<float>& scan_kernels(ScanPath);
template const ScanKernels<std::int32_t>& scan_kernels(ScanPath);

}  // namespace terrace::matching
