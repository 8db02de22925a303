// SPDX-License-Identifier: Apache-2.0
// Published reference values: geodesics, geocentric places, the grids of UTM and UPS.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include <GeographicLib/Geodesic.hpp>
#include <GeographicLib/GeodesicLine.hpp>
#include <GeographicLib/MGRS.hpp>
#include <gtest/gtest.h>

#include "earth/line_distance.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/format/ellipsoid.hpp"

namespace terrace::terrain {
namespace {

std::string data_file(const std::string& name) {
  const char* const data = std::getenv("TERRACE_DATA");
  return data == nullptr ? std::string() : std::string(data) + "/geodesy/" + name;
}

// C. F. F. Karney, "Test set for geodesics", doi:10.5281/zenodo.32156, its short version.
TEST(GeodesyData, MatchesTenThousandGeodesics) {
  const std::string file = data_file("GeodTest-short.dat.gz");
  if (file.empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(
      popen(("gzip -dc '" + file + "'").c_str(), "r"), pclose);
  ASSERT_TRUE(pipe);
  const LineDistance distance(CoordinateSystem{}, 1);
  std::array<char, 512> line{};
  std::size_t rows = 0;
  double worst = 0, worst_sum = 0;
  while (std::fgets(line.data(), static_cast<int>(line.size()), pipe.get()) != nullptr) {
    double lat1 = 0, lon1 = 0, azi1 = 0, lat2 = 0, lon2 = 0, azi2 = 0, metres = 0;
    ASSERT_EQ(std::sscanf(line.data(), "%lf %lf %lf %lf %lf %lf %lf", &lat1, &lon1, &azi1, &lat2,
                          &lon2, &azi2, &metres),
              7);
    worst = std::max(worst, std::abs(distance.between({lon1, lat1}, {lon2, lat2}) - metres));
    // Also measure the geodesic as a polyline of sixteen pieces.
    if (rows++ % 10 != 0) continue;
    const GeographicLib::GeodesicLine path(GeographicLib::Geodesic::WGS84(), lat1, lon1, azi1);
    double sum = 0;
    Point2 from{lon1, lat1};
    for (int i = 1; i <= 16; ++i) {
      Point2 to{};
      path.Position(metres * i / 16, to[1], to[0]);
      sum += distance.between(from, to);
      from = to;
    }
    worst_sum = std::max(worst_sum, std::abs(sum - metres));
  }
  EXPECT_EQ(rows, 10000u);
  EXPECT_LT(worst, 1e-7);  // half of the last digit, plus the method's 15 nm
  EXPECT_LT(worst_sum, 1e-6);
  std::cout << rows << " geodesics: off by " << worst << " m, in 16 pieces by " << worst_sum
            << " m\n";
}

// GEOTRANS: places and their military grid references, to a metre. GeographicLib reads the letters
// of the squares; zones, eastings and northings are compared.
TEST(GeodesyData, MatchesGeotransUtmAndUps) {
  const std::string name = data_file("geotrans_clean.txt");
  if (name.empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  std::ifstream file(name);
  ASSERT_TRUE(file);
  std::map<int, CoordinateSystem> systems;
  double latitude = 0, longitude = 0, worst = 0;
  std::string reference;
  std::size_t rows = 0, polar = 0;
  while (file >> latitude >> longitude >> reference) {
    int zone = 0, precision = 0;
    bool north = false;
    double x = 0, y = 0;
    GeographicLib::MGRS::Reverse(reference, zone, north, x, y, precision, false);
    ASSERT_EQ(precision, 5) << reference;
    const int code = zone == 0 ? (north ? 5041 : 5042) : (north ? 32600 : 32700) + zone;
    auto system = systems.find(code);
    if (system == systems.end()) {
      system = systems.emplace(code, CoordinateSystem::parse("EPSG:" + std::to_string(code))).first;
    }
    const Point2 place = system->second.from_geographic(Point2{longitude, latitude});
    // The reference names the south-western corner of its square metre.
    worst = std::max({worst, std::abs(place[0] - x - 0.5), std::abs(place[1] - y - 0.5)});
    ++rows;
    polar += zone == 0 ? 1 : 0;
  }
  EXPECT_EQ(rows, 37044u);
  EXPECT_EQ(systems.size(), 122u) << "zones";
  EXPECT_GT(polar, 1000u);
  EXPECT_LT(worst, 0.501);
  std::cout << rows << " places in " << systems.size() << " grids, " << polar
            << " of them polar: within " << worst << " m of the middle of the square\n";
}

TEST(GeodesyData, MatchesTenThousandGeocentricPlaces) {
  const std::string name = data_file("xyz_to_llh_10_000.txt");
  if (name.empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  std::ifstream file(name);
  stream::Point3 xyz;
  double longitude = 0, latitude = 0, height = 0, worst = 0;
  std::size_t rows = 0;
  while (file >> xyz[0] >> xyz[1] >> xyz[2] >> longitude >> latitude >> height) {
    const stream::Point3 found = geocentric(longitude, latitude, height);
    worst = std::max(worst, std::hypot(found[0] - xyz[0], found[1] - xyz[1], found[2] - xyz[2]));
    ++rows;
  }
  EXPECT_EQ(rows, 10000u);
  EXPECT_LT(worst, 1e-4);  // heights are written to a tenth of a millimetre
}

}  // namespace
}  // namespace terrace::terrain
