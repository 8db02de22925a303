// SPDX-License-Identifier: Apache-2.0
#define TERRACE_VECTOR_BYTES 64
#include "linkage/kernels_impl.hpp"

namespace terrace::cluster {

const LinkageKernels<float> kLinkageFloatAvx512 = {distances<float>, minima<float>, raise<float>,
                                                   pick<float>, straddling};
const LinkageKernels<double> kLinkageDoubleAvx512 = {distances<double>, minima<double>,
                                                     raise<double>, pick<double>, straddling};

}  // namespace terrace::cluster
