// SPDX-License-Identifier: GPL-3.0-or-later
#include "src/coordinate_system.hpp"

#include <gtest/gtest.h>

#include "src/error.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

TEST(CoordinateSystem, KnowsWhatTheCodesMeasureIn) {
  for (const char* code : {"EPSG:4326", "epsg:4258", "EPSG:4269", "EPSG:4979"}) {
    EXPECT_TRUE(CoordinateSystem::parse(code).is_geographic()) << code;
    EXPECT_EQ(CoordinateSystem::parse(code).crs().horizontal_unit, "degree");
  }
  for (const char* code : {"EPSG:32632", "EPSG:25833", "EPSG:3857", "EPSG:2056"}) {
    EXPECT_FALSE(CoordinateSystem::parse(code).is_geographic()) << code;
    EXPECT_EQ(CoordinateSystem::parse(code).crs().horizontal_unit, "metre") << code;
  }
  EXPECT_EQ(CoordinateSystem::parse("EPSG:2263").crs().horizontal_unit, "US survey foot");
  EXPECT_EQ(CoordinateSystem::parse("EPSG:32632").crs().epsg, 32632);
}

TEST(CoordinateSystem, RefusesOtherText) {
  for (const char* text : {"", "32632", "EPSG:", "EPSG:x", "EPSG:12", "EPSG:99999", "EPSG:4326 ",
                           "EPSG:4326+", "EPSG:4326+4326", "EPSG:5703", "no/such/file.prj"}) {
    EXPECT_THROW(CoordinateSystem::parse(text), UsageError) << text;
  }
}

// The places of Guidance Note 7-2's examples.
TEST(CoordinateSystem, PlacesOfTheGuidanceNote) {
  const CoordinateSystem utm = CoordinateSystem::parse("EPSG:32632");
  const Point2 zugspitze = utm.from_geographic(Point2{10.985361, 47.421066});
  EXPECT_NEAR(zugspitze[0], 649744, 200);
  EXPECT_NEAR(zugspitze[1], 5254000, 2000);
  const Point2 laea = CoordinateSystem::parse("EPSG:3035").from_geographic(Point2{5, 50});
  EXPECT_NEAR(laea[0], 3962799.45, 0.01);
  EXPECT_NEAR(laea[1], 2999718.85, 0.01);
}

}  // namespace
}  // namespace terrace::tools
