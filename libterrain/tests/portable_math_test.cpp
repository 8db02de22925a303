// SPDX-License-Identifier: Apache-2.0
#include "base/portable_math.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

TEST(PortableMath, AgreesWithTheLibrary) {
  for (double degrees = -720; degrees <= 720; degrees += 0.37) {
    // fmod is exact, and the library's argument then has one rounding only.
    const double radians = std::fmod(degrees, 360.0) * kDegree;
    EXPECT_NEAR(portable_sin_degrees(degrees), std::sin(radians), 2e-15) << degrees;
    EXPECT_NEAR(portable_cos_degrees(degrees), std::cos(radians), 2e-15) << degrees;
  }
  for (double x = -690; x <= 690; x += 1.3) {
    EXPECT_NEAR(portable_exp(x) / std::exp(x), 1.0, 1e-15) << x;
    EXPECT_NEAR(portable_exp2(x / 2) / std::exp2(x / 2), 1.0, 1e-13) << x;
  }
}

TEST(PortableMath, LengthsAgreeWithTheLibrary) {
  for (double x = 1e-300; x < 1e300; x *= 1.9) {
    EXPECT_NEAR(portable_hypot(x, 0.7 * x) / std::hypot(x, 0.7 * x), 1.0, 4e-16) << x;
  }
  EXPECT_EQ(portable_hypot(0, -0.0), 0.0);
  EXPECT_EQ(portable_hypot(-3, 4), 5.0);
  EXPECT_TRUE(std::isinf(portable_hypot(-INFINITY, 1)));
  EXPECT_TRUE(std::isnan(portable_hypot(1, NAN)));
}

TEST(PortableMath, GivesNanForNanAndInfinity) {
  for (const double x : {double{NAN}, double{INFINITY}, double{-INFINITY}}) {
    EXPECT_TRUE(std::isnan(portable_sin_degrees(x)));
    EXPECT_TRUE(std::isnan(portable_cos_degrees(x)));
  }
  EXPECT_TRUE(std::isnan(portable_exp(NAN)));
}

TEST(PortableMath, IsExactWhereTheValueIs) {
  EXPECT_EQ(portable_cos_degrees(90), 0.0);
  EXPECT_EQ(portable_cos_degrees(-270), 0.0);
  EXPECT_EQ(portable_sin_degrees(90), 1.0);
  EXPECT_EQ(portable_sin_degrees(180), 0.0);
  EXPECT_EQ(portable_exp(0), 1.0);
}

}  // namespace
}  // namespace terrace::terrain
