// SPDX-License-Identifier: Apache-2.0
#include "samples_impl.hpp"

namespace terrace::tri::tin {

bool check_float_portable(const CheckWindow<float>& window, const CheckTriangle& triangle,
                          CheckSums& sums) {
  return check(window, triangle, sums);
}

bool check_double_portable(const CheckWindow<double>& window, const CheckTriangle& triangle,
                           CheckSums& sums) {
  return check(window, triangle, sums);
}

#ifdef TERRACE_TRI_X86

template <>
CheckSamples<float> check_samples(GridPath path) {
  return path == GridPath::kAvx512 ? check_float_avx512
         : path == GridPath::kAvx2 ? check_float_avx2
                                   : check_float_portable;
}
template <>
CheckSamples<double> check_samples(GridPath path) {
  return path == GridPath::kAvx512 ? check_double_avx512
         : path == GridPath::kAvx2 ? check_double_avx2
                                   : check_double_portable;
}

#else

template <>
CheckSamples<float> check_samples(GridPath) {
  return check_float_portable;
}
template <>
CheckSamples<double> check_samples(GridPath) {
  return check_double_portable;
}

#endif

}  // namespace terrace::tri::tin
