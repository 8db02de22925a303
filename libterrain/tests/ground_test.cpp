// SPDX-License-Identifier: Apache-2.0
#include "earth/ground.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <GeographicLib/Geodesic.hpp>
#include <gtest/gtest.h>
#include <terrace/base/portable_math.hpp>

#include "earth/crs/definition.hpp"

namespace terrace::terrain {
namespace {

stream::Placement geographic(double cell) {
  stream::Placement placement;
  placement.world.xy = {cell, 0, 8.0, 0, -cell, 47.0};
  placement.crs.epsg = 4326;
  placement.crs.geographic = true;
  placement.crs.horizontal_unit = "degree";
  return placement;
}

stream::Box3 around(double column, double row) {
  return {.min = {column - 50, row - 50, 0}, .max = {column + 50, row + 50, 1000}};
}

// Oracle: geodesics a few metres long, computed by GeographicLib.
TEST(MetresPerDegree, AgreesWithGeodesics) {
  const auto& wgs84 = GeographicLib::Geodesic::WGS84();
  for (double latitude = -89.9; latitude <= 89.9; latitude += 0.73) {
    const MetresPerDegree metres = metres_per_degree(latitude);
    // Long enough to make the rounding of latitudes negligible, short enough to be local.
    constexpr double kStep = 1e-4;
    double along_meridian = 0, along_parallel = 0;
    wgs84.Inverse(latitude - kStep, 10, latitude + kStep, 10, along_meridian);
    // The shorter the chord relative to the parallel's radius, the closer geodesic and parallel
    // are.
    const double east = kStep * std::cos(latitude * base::kRadiansPerDegree);
    wgs84.Inverse(latitude, 10 - east, latitude, 10 + east, along_parallel);
    EXPECT_NEAR(metres.latitude / (along_meridian / (2 * kStep)), 1.0, 1e-6) << latitude;
    EXPECT_NEAR(metres.longitude / (along_parallel / (2 * east)), 1.0, 1e-6) << latitude;
  }
}

TEST(MetresPerDegree, IsZeroEastwardOnlyAtPoles) {
  EXPECT_EQ(metres_per_degree(90).longitude, 0.0);
  EXPECT_EQ(metres_per_degree(-120).longitude, 0.0);  // clamped
  EXPECT_NEAR(metres_per_degree(0).longitude, 111319.490793, 1e-6);
  EXPECT_NEAR(metres_per_degree(90).latitude, 6399593.6258 * base::kRadiansPerDegree,
              1e-5);  // a^2 / b
}

TEST(Ground, MapsDegreesAtLatitudeOfBlock) {
  const Ground ground(geographic(1.0 / 1200));
  EXPECT_TRUE(ground.assumption().empty());
  for (const double row : {0.0, 600.0, 40000.0}) {
    const GroundMap map = ground.map(around(300, row));
    const MetresPerDegree metres = metres_per_degree(47.0 - row / 1200);
    EXPECT_DOUBLE_EQ(map[0], metres.longitude / 1200);
    EXPECT_DOUBLE_EQ(map[4], -metres.latitude / 1200);
    EXPECT_EQ(map[8], 1.0);
  }
}

TEST(Ground, TakesUnitsFromTheSource) {
  stream::Placement placement;
  placement.world.xy = {10, 0, 0, 0, -20, 0};  // oblong cells
  placement.crs.horizontal_unit = "US survey foot";
  placement.crs.vertical_unit = "foot";
  placement.coordinates[2].scale = 0.1;
  const GroundMap map = Ground(placement, 3.0).map(around(0, 0));
  EXPECT_DOUBLE_EQ(map[0], 10 * 1200.0 / 3937.0);
  EXPECT_DOUBLE_EQ(map[4], -20 * 1200.0 / 3937.0);
  EXPECT_DOUBLE_EQ(map[8], 0.1 * 0.3048 * 3.0);

  placement.crs.vertical_unit.clear();
  const Ground assumed(placement);
  EXPECT_DOUBLE_EQ(assumed.map(around(0, 0))[8], 0.1 * 1200.0 / 3937.0);
  EXPECT_NE(assumed.assumption(), "");

  placement.coordinates[2].unit = "metre";  // the column's own unit takes precedence
  EXPECT_DOUBLE_EQ(Ground(placement).map(around(0, 0))[8], 0.1);
}

TEST(Ground, ReportsUnknownUnitsAsMetres) {
  const Ground ground{stream::Placement{}};
  EXPECT_NE(ground.assumption().find("metres"), std::string::npos);
  EXPECT_EQ(ground.map(around(0, 0)), (GroundMap{1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

TEST(Ground, KnowsCommonUnitNames) {
  constexpr double kSurveyFoot = 1200.0 / 3937.0;
  const std::pair<double, std::vector<const char*>> words[] = {
      {1.0, {"m", "metre", "Meters", " METRES ", "[m]", "mtr"}},
      {0.3048, {"ft", "Feet", "foot", "Foot_International", "foot (intl)", "ift", "foot_intl"}},
      {kSurveyFoot,
       {"ftUS", "us-ft", "US survey feet", "us_survey_foot", "U.S. Survey Foot", "sfoot", "Foot_US",
        "Foot (US survey)", "usft", "ft-us", "US feet"}},
      {0.01, {"cm", "centimetre", "Centimeters"}},
      {0.001, {"mm", "millimeter"}},
      {0.1, {"dm"}},
      {1000.0, {"km", "kilometers"}},
      {0.0254, {"in", "inches"}},
      {0.9144, {"yd", "Yards"}},
      {1.8288, {"fathom", "fath"}},
      {1852.0, {"nmi", "nautical mile"}},
  };
  for (const auto& [metres, names] : words) {
    for (const char* name : names) EXPECT_EQ(metres_in_unit(name), metres) << name;
  }
  for (const char* name : {"", "counts", "degree", "f t", "metre squared", "survey"}) {
    EXPECT_FALSE(metres_in_unit(name)) << name;
  }
}

TEST(Ground, NamesUnknownHeightUnit) {
  stream::Placement placement = geographic(0.01);
  placement.coordinates[2].unit = "cubits";
  const Ground ground(placement);
  EXPECT_EQ(ground.unknown_height_unit(),
            "the unit of heights, \"cubits\", is not known and taken as metres");
  EXPECT_EQ(ground.assumption(), ground.unknown_height_unit());
  placement.coordinates[2].unit = "cm";
  EXPECT_EQ(Ground(placement).unknown_height_unit(), "");
  EXPECT_EQ(Ground(placement).metres_vertical(), 0.01);
}

TEST(Ground, CorrectsScaleOfWebMercator) {
  stream::Placement placement;
  placement.crs.epsg = 3857;
  placement.crs.horizontal_unit = "metre";
  const Ground ground(placement);
  const auto& wgs84 = GeographicLib::Geodesic::WGS84();
  constexpr double kA = 6378137.0;
  for (double latitude = -80; latitude <= 80; latitude += 16) {
    const auto northing = [&](double phi) {
      return kA * std::log(std::tan((45 + phi / 2) * base::kRadiansPerDegree));
    };
    const double y = northing(latitude);
    const GroundMap map = ground.map({.min = {0, y - 1, 0}, .max = {2, y + 1, 0}});
    double metres = 0;
    wgs84.Inverse(latitude - 1e-3, 0, latitude + 1e-3, 0, metres);
    EXPECT_NEAR(map[4] * (northing(latitude + 1e-3) - northing(latitude - 1e-3)) / metres, 1.0,
                1e-6);
    wgs84.Inverse(latitude, -1e-4, latitude, 1e-4, metres);
    EXPECT_NEAR(map[0] * (2e-4 * base::kRadiansPerDegree * kA) / metres, 1.0, 1e-6);
  }
}

// Oracle: geodesics across a cell in the map's directions.
TEST(Ground, KnowsLocalScaleOfProjections) {
  const auto& wgs84 = GeographicLib::Geodesic::WGS84();
  struct Case {
    int code;
    double x, y, unit;
  };
  for (const Case& test : {Case{32632, 500000, 5200000, 1}, Case{32632, 200000, 5200000, 1},
                           Case{3035, 5500000, 1700000, 1}, Case{5070, -1900000, 2900000, 1},
                           Case{3413, 500000, -900000, 1}, Case{2154, 200000, 6900000, 1},
                           Case{2263, 1000000, 200000, 1200.0 / 3937.0}}) {
    SCOPED_TRACE(test.code);
    const CoordinateSystem system(definition_of_epsg(test.code));
    stream::Placement placement;
    placement.world.xy = {10, 0, test.x, 0, -10, test.y};
    placement.crs = system.crs();
    const Ground ground(placement);
    const GroundMap map = ground.map({.min = {-1, -1, 0}, .max = {1, 1, 1}});
    for (const auto& [dx, dy] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}, {1.0, -1.0}}) {
      Point2 ends[2] = {{test.x - 100 * dx, test.y - 100 * dy},
                        {test.x + 100 * dx, test.y + 100 * dy}};
      system.to_own_geographic(ends);
      double metres = 0;
      wgs84.Inverse(ends[0][1], ends[0][0], ends[1][1], ends[1][0], metres);
      const stream::Point3 step = apply(map, {20 * dx, -20 * dy, 0});
      EXPECT_NEAR(std::hypot(step[0], step[1]) / metres, 1, 3e-5);
    }
  }
}

TEST(World, BoxOfRotatedRasterContainsAllCorners) {
  stream::Placement placement;
  placement.world.xy = {0.8, -0.6, 100, 0.6, 0.8, 200};
  placement.coordinates[2] = {.name = "z", .scale = -2, .offset = 5, .unit = ""};
  const stream::Box3 box = world_box(placement, {.min = {0, 0, 0}, .max = {10, 10, 1}});
  EXPECT_EQ(box.min, (stream::Point3{94, 200, 3}));
  EXPECT_EQ(box.max, (stream::Point3{108, 214, 5}));
}

}  // namespace
}  // namespace terrace::terrain
