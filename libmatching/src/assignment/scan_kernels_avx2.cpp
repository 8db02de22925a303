// SPDX-License-Identifier: Apache-2.0
#define TERRACE_VECTOR_BYTES 32
#include "assignment/scan_kernels_impl.hpp"

namespace terrace::matching {

extern const ScanKernels<double> kScanDoubleAvx2;
extern const ScanKernels<float> kScanFloatAvx2;
extern const ScanKernels<std::int32_t> kScanIntAvx2;
const ScanKernels<double> kScanDoubleAvx2 = {relax<double>, least_two<double>};
const ScanKernels<float> kScanFloatAvx2 = {relax<float>, least_two<float>};
const ScanKernels<std::int32_t> kScanIntAvx2 = {relax<std::int32_t>, least_two<std::int32_t>};

}  // namespace terrace::matching
