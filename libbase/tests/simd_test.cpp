// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

namespace terrace::base {
namespace {

TEST(Simd, TheBestPathIsSupported) {
  EXPECT_NE(best_simd_path(), SimdPath::automatic);
  EXPECT_TRUE(supports(best_simd_path()));
  for (const SimdPath path : {SimdPath::portable, SimdPath::avx2, SimdPath::avx512}) {
    if (supports(path)) {
      EXPECT_LE(path, best_simd_path());
    }
  }
  EXPECT_TRUE(supports(SimdPath::automatic));
  EXPECT_FALSE(supports(static_cast<SimdPath>(99)));
}

}  // namespace
}  // namespace terrace::base
