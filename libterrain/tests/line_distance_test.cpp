// SPDX-License-Identifier: Apache-2.0
#include "earth/line_distance.hpp"

#include <cmath>
#include <vector>

#include <GeographicLib/Ellipsoid.hpp>
#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

LineDistance distance_in(const char* crs) { return {CoordinateSystem::parse(crs), 1}; }

/// Lengths of parallels and meridians have closed formulas that need no geodesics.
double parallel(const GeographicLib::Ellipsoid& earth, double latitude, double degrees) {
  return earth.CircleRadius(latitude) * degrees * 3.14159265358979323846 / 180;
}

double polyline(const LineDistance& distance, const std::vector<Point2>& line) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) sum += distance.along(line[i], line[i + 1]);
  return sum;
}

TEST(LineDistance, IsExactAlongParallelsAndMeridians) {
  const LineDistance degrees = distance_in("EPSG:4326");
  const GeographicLib::Ellipsoid& earth = GeographicLib::Ellipsoid::WGS84();
  for (const double latitude : {0.0, 0.5, -33.0, 60.0, 80.0}) {
    for (const double turn : {0.001, 1.0, 170.0, 358.0, 360.0}) {
      SCOPED_TRACE(std::to_string(latitude) + " " + std::to_string(turn));
      const double length = parallel(earth, latitude, turn);
      EXPECT_NEAR(degrees.along({-180, latitude}, {-180 + turn, latitude}), length, 1e-7 * length);
      EXPECT_NEAR(degrees.along({180, latitude}, {180 - turn, latitude}), length, 1e-7 * length);
      // The shortest path between the same places differs.
      EXPECT_LE(degrees.between({-180, latitude}, {-180 + turn, latitude}), length * (1 + 1e-9));
    }
  }
  const double quarter = earth.QuarterMeridian();
  EXPECT_NEAR(degrees.along({7, 0}, {7, 90}), quarter, 1e-5);
  EXPECT_NEAR(polyline(degrees, {{7, -90}, {7, 30}, {9, 30}, {9, 90}}),
              2 * quarter + parallel(earth, 30, 2), 0.01);
}

TEST(LineDistance, CorrectsMapScale) {
  // On its central meridian, a UTM zone has a scale of 0.9996.
  const LineDistance utm = distance_in("EPSG:32632");
  EXPECT_NEAR(utm.along({500000, 5000000}, {500000, 5100000}), 100000 / 0.9996, 1e-6);
  // In US survey feet.
  const LineDistance feet = distance_in("EPSG:2263");
  const double metres = feet.along({1000000, 200000}, {1001000, 200000});
  EXPECT_NEAR(metres, 304.8, 0.05);
  // Mercator's scale grows with the latitude: along a parallel by its radius.
  const LineDistance web = distance_in("EPSG:3857");
  const CoordinateSystem system = CoordinateSystem::parse("EPSG:3857");
  const Point2 a = system.from_geographic(Point2{5, 60}), b = system.from_geographic(Point2{6, 60});
  const double length = parallel(GeographicLib::Ellipsoid::WGS84(), 60, 1);
  EXPECT_NEAR(web.along(a, b), length, 1e-7 * length);
  EXPECT_LT(web.between(a, b), web.along(a, b));
}

TEST(LineDistance, UsesEllipsoidOfAnotherDatum) {
  // An unknown datum without a shift.
  const LineDistance own =
      distance_in(R"(GEOGCS["own",DATUM["own datum",SPHEROID["International 1924",6378388,297]],)"
                  R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])");
  const GeographicLib::Ellipsoid international(6378388, 1 / 297.0);
  const double length = parallel(international, 45, 10);
  EXPECT_NEAR(own.along({0, 45}, {10, 45}), length, 1e-7 * length);
  EXPECT_GT(std::abs(length - parallel(GeographicLib::Ellipsoid::WGS84(), 45, 10)), 10);
}

TEST(LineDistance, UsesMapDistancesWithoutCrs) {
  const LineDistance plain(std::nullopt, 0.3048);
  EXPECT_DOUBLE_EQ(plain.between({0, 0}, {3, 4}), 5 * 0.3048);
  EXPECT_NEAR(plain.along({0, 0}, {30000, 40000}), 50000 * 0.3048, 1e-6);
  EXPECT_EQ(plain.along({1, 2}, {1, 2}), 0);
  EXPECT_TRUE(std::isnan(plain.along({0, 0}, {NAN, 0})));
  // Outside the system's area, distances are those of the map.
  const LineDistance azimuthal = distance_in("EPSG:3035");
  EXPECT_DOUBLE_EQ(azimuthal.between({3e7, 0}, {3e7, 100}), 100);
}

}  // namespace
}  // namespace terrace::terrain
