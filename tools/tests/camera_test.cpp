// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/camera.hpp"

#include <gtest/gtest.h>

#include "base/vector.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

TEST(ParseView, AcceptsTopAndTwoAngles) {
  EXPECT_EQ(parse_view("top").elevation, 90);
  EXPECT_EQ(parse_view("-30,45.5").azimuth, -30);
  for (const char* text : {"", "up", "1", "1,2,3", "0,91", "0,nan"}) {
    EXPECT_THROW(parse_view(text), UsageError) << text;
  }
}

TEST(Camera, FromAboveNorthIsUpAndEastIsRight) {
  const Camera camera({});
  EXPECT_NEAR(camera.right[0], 1, 1e-15);
  EXPECT_NEAR(camera.up[1], 1, 1e-15);
  EXPECT_NEAR(camera.toward[2], 1, 1e-15);
}

TEST(Camera, FromTheSouthTheSkyIsUp) {
  const Camera camera({.azimuth = 180, .elevation = 0});
  EXPECT_NEAR(camera.right[0], 1, 1e-15);
  EXPECT_NEAR(camera.up[2], 1, 1e-15);
  EXPECT_NEAR(camera.toward[1], -1, 1e-15);
}

TEST(Camera, IsOrthonormalAndRightHanded) {
  for (double azimuth = 0; azimuth < 360; azimuth += 17) {
    for (double elevation = -90; elevation <= 90; elevation += 15) {
      const Camera c({.azimuth = azimuth, .elevation = elevation});
      EXPECT_NEAR(dot(c.right, c.up), 0, 1e-15);
      EXPECT_NEAR(dot(c.up, c.toward), 0, 1e-15);
      EXPECT_NEAR(dot(c.right, c.right), 1, 1e-15);
      EXPECT_NEAR(dot(c.up, c.up), 1, 1e-15);
      const double handed = c.right[0] * (c.up[1] * c.toward[2] - c.up[2] * c.toward[1]) -
                            c.right[1] * (c.up[0] * c.toward[2] - c.up[2] * c.toward[0]) +
                            c.right[2] * (c.up[0] * c.toward[1] - c.up[1] * c.toward[0]);
      EXPECT_NEAR(handed, 1, 1e-14);
    }
  }
}

}  // namespace
}  // namespace terrace::tools
