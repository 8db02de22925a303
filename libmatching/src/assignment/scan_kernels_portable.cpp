// SPDX-License-Identifier: Apache-2.0
#define TERRACE_VECTOR_BYTES 16
#include "assignment/scan_kernels_impl.hpp"

namespace terrace::matching {

extern const ScanKernels<double> kScanDoublePortable;
extern const ScanKernels<float> kScanFloatPortable;
extern const ScanKernels<std::int32_t> kScanIntPortable;
const ScanKernels<double> kScanDoublePortable = {relax<double>, least_two<double>};
const ScanKernels<float> kScanFloatPortable = {relax<float>, least_two<float>};
const ScanKernels<std::int32_t> kScanIntPortable = {relax<std::int32_t>, least_two<std::int32_t>};

}  // namespace terrace::matching
