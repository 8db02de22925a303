// SPDX-License-Identifier: Apache-2.0
#include "samples_impl.hpp"

namespace terrace::tri::tin {

bool check_float_avx2(const CheckWindow<float>& window, const CheckTriangle& triangle,
                      CheckSums& sums) {
  return check(window, triangle, sums);
}

bool check_double_avx2(const CheckWindow<double>& window, const CheckTriangle& triangle,
                       CheckSums& sums) {
  return check(window, triangle, sums);
}

}  // namespace terrace::tri::tin
