// SPDX-License-Identifier: Apache-2.0
#include "portable_math.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace terrace::tri {
namespace {

TEST(PortableMath, PowersAgreeWithTheLibrary) {
  for (double x = 1e-300; x < 1e300; x *= 1.9) {
    EXPECT_NEAR(portable::logarithm(x), std::log(x), 1e-15 * std::abs(std::log(x))) << x;
  }
  for (double x = -690; x <= 690; x += 1.3) {
    EXPECT_NEAR(portable::exponential(x) / std::exp(x), 1.0, 1e-15) << x;
  }
  EXPECT_EQ(portable::logarithm(1), 0.0);
  EXPECT_EQ(portable::exponential(0), 1.0);
}

}  // namespace
}  // namespace terrace::tri
