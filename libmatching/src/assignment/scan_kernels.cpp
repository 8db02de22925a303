// SPDX-License-Identifier: Apache-2.0
#include "assignment/scan_kernels.hpp"

#include <type_traits>

#include <terrace/base/simd.hpp>

namespace terrace::matching {

extern const ScanKernels<double> kScanDoublePortable, kScanDoubleAvx2, kScanDoubleAvx512;
extern const ScanKernels<float> kScanFloatPortable, kScanFloatAvx2, kScanFloatAvx512;
extern const ScanKernels<std::int32_t> kScanIntPortable, kScanIntAvx2, kScanIntAvx512;

template <class Cost>
const ScanKernels<Cost>& scan_kernels([[maybe_unused]] base::SimdPath path) {
  if constexpr (std::is_same_v<Cost, double>) {
#ifdef TERRACE_MATCHING_X86
    if (path == base::SimdPath::avx512) return kScanDoubleAvx512;
    if (path == base::SimdPath::avx2) return kScanDoubleAvx2;
#endif
    return kScanDoublePortable;
  } else if constexpr (std::is_same_v<Cost, float>) {
#ifdef TERRACE_MATCHING_X86
    if (path == base::SimdPath::avx512) return kScanFloatAvx512;
    if (path == base::SimdPath::avx2) return kScanFloatAvx2;
#endif
    return kScanFloatPortable;
  } else {
#ifdef TERRACE_MATCHING_X86
    if (path == base::SimdPath::avx512) return kScanIntAvx512;
    if (path == base::SimdPath::avx2) return kScanIntAvx2;
#endif
    return kScanIntPortable;
  }
}

template <class Cost>
const ScanKernels<Cost>& scan_kernels() {
  return scan_kernels<Cost>(base::best_simd_path());
}

template const ScanKernels<double>& scan_kernels();
template const ScanKernels<float>& scan_kernels();
template const ScanKernels<std::int32_t>& scan_kernels();
template const ScanKernels<double>& scan_kernels(base::SimdPath);
template const ScanKernels<float>& scan_kernels(base::SimdPath);
template const ScanKernels<std::int32_t>& scan_kernels(base::SimdPath);

}  // namespace terrace::matching
