// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <terrace/base/portable_math.hpp>

namespace terrace::base {
namespace {

TEST(PortableMath, AnglesAgreeWithTheLibrary) {
  for (double degrees = -720; degrees <= 720; degrees += 0.37) {
    // fmod is exact, and the library's argument then has one rounding only.
    const double radians = std::fmod(degrees, 360.0) * kRadiansPerDegree;
    EXPECT_NEAR(sin_degrees(degrees), std::sin(radians), 2e-15) << degrees;
    EXPECT_NEAR(cos_degrees(degrees), std::cos(radians), 2e-15) << degrees;
    const auto [s, c] = sin_cos_degrees(degrees);
    EXPECT_EQ(s, sin_degrees(degrees)) << degrees;
    EXPECT_EQ(c, cos_degrees(degrees)) << degrees;
    const double back = atan2_degrees(s, c);
    EXPECT_NEAR(std::remainder(back - degrees, 360.0), 0.0, 1e-13) << degrees;
    EXPECT_NEAR(back, std::atan2(s, c) / kRadiansPerDegree, 1e-13) << degrees;
  }
}

TEST(PortableMath, AnglesAreExactAtMultiplesOf90And45) {
  for (int quarter = -8; quarter <= 8; ++quarter) {
    const auto [s, c] = sin_cos_degrees(90.0 * quarter);
    EXPECT_EQ(std::abs(s), quarter % 2 == 0 ? 0.0 : 1.0);
    EXPECT_EQ(std::abs(c), quarter % 2 == 0 ? 1.0 : 0.0);
  }
  EXPECT_EQ(sin_degrees(90), 1.0);
  EXPECT_EQ(cos_degrees(180), -1.0);
  EXPECT_EQ(atan2_degrees(1, 1), 45.0);
  EXPECT_EQ(atan2_degrees(-1, -1), -135.0);
  EXPECT_EQ(atan2_degrees(0.0, -1), 180.0);
  EXPECT_EQ(atan2_degrees(-0.0, -1), -180.0);
  EXPECT_EQ(atan2_degrees(1, 0.0), 90.0);
}

TEST(PortableMath, AnglesOfNanAndInfinityAreNan) {
  for (const double x : {double{NAN}, double{INFINITY}, double{-INFINITY}}) {
    EXPECT_TRUE(std::isnan(sin_degrees(x)));
    EXPECT_TRUE(std::isnan(cos_degrees(x)));
  }
  EXPECT_TRUE(std::isnan(atan2_degrees(NAN, 1)));
}

TEST(PortableMath, LengthsAgreeWithTheLibrary) {
  for (double x = 1e-300; x < 1e300; x *= 1.9) {
    EXPECT_NEAR(base::hypot(x, 0.7 * x) / std::hypot(x, 0.7 * x), 1.0, 4e-16) << x;
  }
  EXPECT_EQ(base::hypot(0, -0.0), 0.0);
  EXPECT_EQ(base::hypot(-3, 4), 5.0);
  EXPECT_TRUE(std::isinf(base::hypot(-INFINITY, 1)));
  EXPECT_TRUE(std::isnan(base::hypot(1, NAN)));
}

TEST(PortableMath, ExponentialsAndLogarithmsAgreeWithTheLibrary) {
  for (double x = 1e-300; x < 1e300; x *= 1.9) {
    EXPECT_NEAR(base::log(x), std::log(x), 1e-15 * std::abs(std::log(x))) << x;
  }
  for (double x = -690; x <= 690; x += 1.3) {
    EXPECT_NEAR(base::exp(x) / std::exp(x), 1.0, 1e-15) << x;
    EXPECT_NEAR(base::exp2(x / 2) / std::exp2(x / 2), 1.0, 1e-13) << x;
  }
  EXPECT_EQ(base::log(1), 0.0);
  EXPECT_EQ(base::exp(0), 1.0);
  EXPECT_TRUE(std::isnan(base::exp(NAN)));
}

TEST(PortableMath, PowersAgreeWithTheLibrary) {
  for (const double p : {0.1, 0.5, 1.0, 1.5, 2.0, 3.0, 7.25}) {
    EXPECT_EQ(base::pow(0.0, p), 0.0);
    EXPECT_EQ(base::pow(1.0, p), 1.0);
    for (double x = 0.01; x < 100.0; x *= 1.13) {
      EXPECT_NEAR(base::pow(x, p) / std::pow(x, p), 1.0, 1e-14) << x << "^" << p;
    }
  }
  EXPECT_GT(base::pow(std::numeric_limits<double>::denorm_min(), 0.1), 0.0);
  EXPECT_TRUE(std::isinf(base::pow(1e300, 2.5)));
}

TEST(PortableMath, PolynomialsAddUpTheirTerms) {
  EXPECT_EQ((polynomial(std::array{3.0}, 2.0)), 3.0);
  EXPECT_EQ((polynomial(std::array{3.0, 5.0}, 2.0)), 13.0);
  EXPECT_EQ((polynomial(std::array{3.0, 5.0, 7.0, 11.0}, 2.0)), 3.0 + 10.0 + 28.0 + 88.0);
}

}  // namespace
}  // namespace terrace::base
