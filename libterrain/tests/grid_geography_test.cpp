// SPDX-License-Identifier: Apache-2.0
#include "earth/grid_geography.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

struct PlacedGrid {
  const char* crs;
  stream::WorldTransform world;
};

/// Returns the largest difference from exact places in degrees, ignoring turns of 360. Near poles,
/// longitudes are weighted with the cosine of the latitude.
double worst_of(const PlacedGrid& test, std::int64_t column, std::int64_t row, std::size_t columns,
                std::size_t rows) {
  const CoordinateSystem system = CoordinateSystem::parse(test.crs);
  const GridGeography grid(system, test.world);
  std::vector<double> longitude(columns * rows), latitude(columns * rows);
  grid.window(column, row, columns, rows, longitude, latitude);
  double worst = 0;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      const Point2 truth = grid.place(static_cast<double>(column + static_cast<std::int64_t>(i)),
                                      static_cast<double>(row + static_cast<std::int64_t>(j)));
      const double x = longitude[j * columns + i], y = latitude[j * columns + i];
      if (std::isnan(truth[0])) {
        EXPECT_TRUE(std::isnan(x) && std::isnan(y));
        continue;
      }
      EXPECT_TRUE(system.is_geographic() || std::abs(x) <= 180) << x;
      const double turn = std::abs(std::remainder(x - truth[0], 360.0));
      worst = std::max({worst, turn, std::abs(y - truth[1])});
    }
  }
  return worst;
}

TEST(GridGeography, StaysWithinTolerance) {
  const PlacedGrid cases[] = {
      {"EPSG:32632", {{30, 0, 400000, 0, -30, 5200000}}},
      {"EPSG:32632", {{24, -18, 400000, -18, -24, 5200000}}},   // rotated
      {"EPSG:32632", {{1000, 0, -500000, 0, -1000, 9000000}}},  // coarse, far off
      {"EPSG:3857", {{150, 0, 900000, 0, -150, 6000000}}},
      {"EPSG:3857", {{20000, 0, -2e7, 0, -20000, 2e7}}},  // the world
      {"EPSG:3035", {{25, 0, 4000000, 0, -25, 3000000}}},
      {"EPSG:2154", {{5, 0, 600000, 0, -5, 6700000}}},
      {"EPSG:5070", {{30, 0, -2000000, 0, -30, 3000000}}},
      {"EPSG:3413", {{250, 0, -60000, 0, -250, 60000}}},  // around the pole
      {"EPSG:3031", {{2000, 0, -250000, 0, -2000, 250000}}},
      {"EPSG:32660", {{500, 0, 770000, 0, -500, 1200000}}},  // across the antimeridian
      {"EPSG:2263", {{10, 0, 900000, 0, -10, 250000}}},      // feet
      {"EPSG:4326", {{1e-3, 0, 179.9, 0, -1e-3, 47}}},
      {"EPSG:6931", {{1e5, 0, -2e7, 0, -1e5, 2e7}}},  // reaches beyond the earth
  };
  for (const PlacedGrid& test : cases) {
    SCOPED_TRACE(std::string(test.crs) + " " + std::to_string(test.world.xy[0]));
    EXPECT_LE(worst_of(test, 0, 0, 500, 300), GridGeography::kTolerance);
    EXPECT_LE(worst_of(test, -7, 1001, 131, 65), GridGeography::kTolerance);
    EXPECT_LE(worst_of(test, 3, 3, 1, 1), GridGeography::kTolerance);
  }
}

TEST(GridGeography, StaysWithinToleranceOnRandomGrids) {
  const char* const systems[] = {"EPSG:32633", "EPSG:25831", "EPSG:3035", "EPSG:3034",
                                 "EPSG:2154",  "EPSG:3857",  "EPSG:3995", "EPSG:3338"};
  std::mt19937_64 random(20250117);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE(round);
    const char* const crs = systems[random() % 8];
    const double cell = std::pow(10.0, 4 * unit()), angle = 6.3 * unit();
    const double x = (unit() - 0.3) * 3e6, y = (unit() - 0.2) * 6e6;
    const stream::WorldTransform world{{cell * std::cos(angle), cell * std::sin(angle), x,
                                        cell * std::sin(angle), -cell * std::cos(angle), y}};
    EXPECT_LE(worst_of({crs, world}, 0, 0, 129, 70), GridGeography::kTolerance)
        << crs << ' ' << cell;
  }
}

TEST(GridGeography, NeedsOperationToWgs84) {
  const char* const unknown =
      R"(GEOGCS["own",DATUM["own datum",SPHEROID["own",6377000,300]],PRIMEM["Greenwich",0],)"
      R"(UNIT["degree",0.0174532925199433]])";
  EXPECT_THROW(GridGeography(CoordinateSystem::parse(unknown), {}), stream::Error);
}

TEST(GridGeography, AcceptsEmptyWindow) {
  const GridGeography grid(CoordinateSystem::parse("EPSG:32632"), {});
  grid.window(0, 0, 0, 0, {}, {});
  grid.window(0, 0, 0, 5, {}, {});
}

}  // namespace
}  // namespace terrace::terrain
