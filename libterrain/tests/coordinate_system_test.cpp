// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "earth/crs/definition.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

// Guidance Note 7-2 (2019), the examples of sections 3.1 to 3.5 that have an EPSG code.
TEST(CoordinateSystem, MatchesExamplesOfGuidanceNote) {
  struct Example {
    const char* crs;
    Point2 degrees, plane;
    double tolerance;
  };
  const double minute = 1.0 / 60, second = 1.0 / 3600;
  const Example examples[] = {
      {"EPSG:3035", {5, 50}, {3962799.45, 2999718.85}, 0.01},
      {"EPSG:28992", {6, 53}, {196105.283, 557057.739}, 0.001},
      {"EPSG:27700", {0.5, 50.5}, {577274.99, 69740.50}, 0.01},
      {"EPSG:5041", {44, 73}, {3320416.75, 632668.43}, 0.01},
      {"EPSG:3857",
       {-(100 + 20 * minute), 24 + 22 * minute + 54.433 * second},
       {-11169055.58, 2800000.00},
       0.01},
  };
  for (const Example& example : examples) {
    SCOPED_TRACE(example.crs);
    const CoordinateSystem system = CoordinateSystem::parse(example.crs);
    Point2 place = example.degrees;
    system.from_own_geographic({&place, 1});
    EXPECT_NEAR(place[0], example.plane[0], example.tolerance);
    EXPECT_NEAR(place[1], example.plane[1], example.tolerance);
    system.to_own_geographic({&place, 1});
    // A tenth of a micrometre for GeographicLib, a millimetre for PROJ's series for equal areas.
    const double exact = system.definition().method ? 1e-12 : 1e-8;
    EXPECT_NEAR(place[0], example.degrees[0], exact);
    EXPECT_NEAR(place[1], example.degrees[1], exact);
  }
}

TEST(CoordinateSystem, IsThreadSafe) {
  const CoordinateSystem shared =
      CoordinateSystem::parse("EPSG:5514").over({{-743000, -1044000, 0}, {-741000, -1042000, 0}});
  const CoordinateSystem alone =
      CoordinateSystem::parse("EPSG:5514").over({{-743000, -1044000, 0}, {-741000, -1042000, 0}});
  std::vector<Point2> expected;
  for (int i = 0; i < 1000; ++i)
    expected.push_back(alone.to_geographic(Point2{-742500.0 + i, -1043000}));
  std::array<int, 4> wrong{};
  {
    std::vector<std::jthread> threads;
    for (int& count : wrong) {
      threads.emplace_back([&shared, &expected, &count] {
        for (std::size_t i = 0; i < expected.size(); ++i) {
          const Point2 place =
              shared.to_geographic(Point2{-742500.0 + static_cast<double>(i), -1043000});
          count += place == expected[i] ? 0 : 1;
          if (i % 100 == 0)
            count += CoordinateSystem::parse("EPSG:28992").crs().epsg == 28992 ? 0 : 1;
        }
      });
    }
  }
  EXPECT_EQ(wrong, (std::array<int, 4>{}));
}

TEST(CoordinateSystem, HandlesPolesAndInvalidPlaces) {
  const auto forward = [](const char* crs, Point2 place) {
    return CoordinateSystem::parse(crs).from_geographic(place);
  };
  for (const char* crs : {"EPSG:3857", "EPSG:3395"}) {
    EXPECT_TRUE(std::isnan(forward("EPSG:3857", {0, 90})[0])) << crs;
  }
  EXPECT_TRUE(std::isnan(forward("EPSG:32632", {9, 90.5})[0]));
  EXPECT_TRUE(std::isnan(forward("EPSG:32632", {NAN, 0})[0]));
  EXPECT_NEAR(forward("EPSG:3413", {123, 90})[0], 0, 1e-6);
  EXPECT_NEAR(forward("EPSG:32661", {0, 90})[1], 2000000, 1e-6);
  EXPECT_TRUE(std::isnan(forward("EPSG:3413", {0, -90})[0]));
  // Longitudes beyond the antimeridian are the same place.
  const Point2 east = forward("EPSG:32660", {181, 10}), west = forward("EPSG:32660", {-179, 10});
  EXPECT_NEAR(east[0], west[0], 1e-8);
  EXPECT_LT(CoordinateSystem::parse("EPSG:32660").to_geographic(east)[0], -178.99);
  const Point2 outside = CoordinateSystem::parse("EPSG:3035").to_geographic(Point2{3e7, 0});
  EXPECT_TRUE(std::isnan(outside[0]));
}

std::vector<std::vector<double>> rows_of(const std::string& name) {
  const char* const data = std::getenv("TERRACE_DATA");
  std::vector<std::vector<double>> rows;
  if (data == nullptr) return rows;
  std::ifstream file(std::string(data) + "/geodesy/" + name);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    if (line.starts_with('#')) continue;
    std::vector<double> row;
    for (double value = 0; words >> value;) row.push_back(value);
    rows.push_back(row);
  }
  return rows;
}

// GeographicLib's exact projection (elliptic functions), in metres without a false origin.
TEST(CoordinateSystem, MatchesExactTransverseMercator) {
  const auto rows = rows_of("utm_tm_exact_2000.tsv");
  if (rows.empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  ASSERT_EQ(rows.size(), 2000u);
  double worst = 0;
  for (const auto& row : rows) {
    const int zone = static_cast<int>(row[0]);
    const CoordinateSystem utm(definition_of_epsg((row[1] < 0 ? 32700 : 32600) + zone));
    const Point2 plane = utm.from_geographic(Point2{row[2], row[1]});
    const double north = row[1] < 0 ? 1e7 : 0;
    worst =
        std::max({worst, std::abs(plane[0] - 5e5 - row[3]), std::abs(plane[1] - north - row[4])});
  }
  EXPECT_LT(worst, 1e-8);
}

TEST(PlaceConversion, StopsWhenRequested) {
  struct Stop {};
  const PlaceConversion places(
      Transformation(CoordinateSystem::parse("EPSG:32632"), CoordinateSystem::parse("EPSG:4326")));
  std::vector<stream::Point3> points(20000, stream::Point3{500000, 5000000, 7});
  std::size_t calls = 0;
  EXPECT_THROW(places(points,
                      [&] {
                        if (++calls == 10) throw Stop();
                      }),
               Stop);
  EXPECT_EQ(calls, 10U);
  EXPECT_EQ(points.back(), (stream::Point3{500000, 5000000, 7}));
}

}  // namespace
}  // namespace terrace::terrain
