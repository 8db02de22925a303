// SPDX-License-Identifier: Apache-2.0
#include "linkage/kernels.hpp"

#include <stdexcept>

namespace terrace::cluster {

template <class T>
const LinkageKernels<T>& linkage_kernels(SimdPath path) {
  const SimdPath best = best_simd_path();
  if (path == SimdPath::automatic) path = best;
  if (path > best) {
    throw std::invalid_argument(
        "this processor lacks the instructions of the requested SIMD path; "
        "SimdPath::automatic takes the best available");
  }
#ifdef TERRACE_CLUSTER_X86
  if constexpr (sizeof(T) == sizeof(float)) {
    if (path == SimdPath::avx512) return kLinkageFloatAvx512;
    if (path == SimdPath::avx2) return kLinkageFloatAvx2;
  } else {
    if (path == SimdPath::avx512) return kLinkageDoubleAvx512;
    if (path == SimdPath::avx2) return kLinkageDoubleAvx2;
  }
#endif
  if constexpr (sizeof(T) == sizeof(float)) {
    return kLinkageFloatPortable;
  } else {
    return kLinkageDoublePortable;
  }
}

template const LinkageKernels<float>& linkage_kernels(SimdPath);
template const LinkageKernels<double>& linkage_kernels(SimdPath);

}  // namespace terrace::cluster
