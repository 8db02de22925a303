// SPDX-License-Identifier: Apache-2.0
#define TERRACE_VECTOR_BYTES 64
#include "assignment/scan_kernels_impl.hpp"

namespace terrace::matching {

extern const ScanKernels<double> kScanDoubleAvx512;
extern const ScanKernels<float> kScanFloatAvx512;
extern const ScanKernels<std::int32_t> kScanIntAvx512;
const ScanKernels<double> kScanDoubleAvx512 = {relax<double>, least_two<double>};
const ScanKernels<float> kScanFloatAvx512 = {relax<float>, least_two<float>};
const ScanKernels<std::int32_t> kScanIntAvx512 = {relax<std::int32_t>, least_two<std::int32_t>};

}  // namespace terrace::matching
