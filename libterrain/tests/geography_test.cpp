// SPDX-License-Identifier: Apache-2.0
#include "earth/geography.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

struct PlacedBox {
  const char* crs;
  Point2 low, high;
};

constexpr PlacedBox kBoxes[] = {
    {"EPSG:32632", {400000, 5000000}, {900000, 5500000}},
    {"EPSG:32632", {500000, 5200000}, {500000, 5200010}},  // no width
    {"EPSG:2994", {635576, 848881}, {639005, 853539}},     // feet, another datum
    {"EPSG:27700", {0, 0}, {700000, 1300000}},
    {"EPSG:3857", {-2e7, -2e7}, {2e7, 2e7}},               // the world
    {"EPSG:3413", {-60000, -60000}, {60000, 60000}},       // around the pole
    {"EPSG:32660", {770000, 1000000}, {870000, 1200000}},  // across the antimeridian
    {"EPSG:6931", {-2e7, -2e7}, {2e7, 2e7}},               // reaches beyond the earth
    {"EPSG:4326", {5, 45}, {10, 50}},
    {"EPSG:4277", {-8, 49}, {2, 61}},  // degrees of another datum
};

TEST(BoxGeography, StaysWithinToleranceInsideAndOutside) {
  std::mt19937_64 random(20261124);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (const PlacedBox& test : kBoxes) {
    SCOPED_TRACE(test.crs);
    const CoordinateSystem system = CoordinateSystem::parse(test.crs);
    const BoxGeography geography(system,
                                 {{test.low[0], test.low[1], 0}, {test.high[0], test.high[1], 0}});
    std::vector<Point2> places(3000);
    for (Point2& p : places) {
      for (std::size_t k = 0; k < 2; ++k) {
        // Up to a tenth beyond the box, and some exactly on its corners.
        const double t = std::clamp(1.3 * unit() - 0.15, -0.1, 1.1);
        const double on_box = t < 0 && unit() < 0.5 ? 0 : t > 1 && unit() < 0.5 ? 1 : t;
        p[k] = test.low[k] + on_box * (test.high[k] - test.low[k]);
      }
    }
    std::vector<Point2> truth = places, found = places;
    system.to_geographic(truth);
    geography(found);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (std::isnan(truth[i][0])) {
        wrong += std::isnan(found[i][0]) && std::isnan(found[i][1]) ? 0 : 1;
        continue;
      }
      EXPECT_LE(std::abs(found[i][0]), 180.0);
      const double turn = std::abs(std::remainder(found[i][0] - truth[i][0], 360.0));
      const double off = std::max(turn, std::abs(found[i][1] - truth[i][1]));
      wrong += off <= kGeographyTolerance ? 0 : 1;
      // The result does not depend on the other places.
      Point2 alone = places[i];
      geography(std::span(&alone, 1));
      EXPECT_EQ(alone, found[i]);
    }
    EXPECT_EQ(wrong, 0U);
  }
}

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
    EXPECT_LE(worst_of(test, 0, 0, 500, 300), kGeographyTolerance);
    EXPECT_LE(worst_of(test, -7, 1001, 131, 65), kGeographyTolerance);
    EXPECT_LE(worst_of(test, 3, 3, 1, 1), kGeographyTolerance);
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
    EXPECT_LE(worst_of({crs, world}, 0, 0, 129, 70), kGeographyTolerance) << crs << ' ' << cell;
  }
}

/// Systems of both engines, with and without a change of datum. Of the last five, grids with kinks
/// change the datum: those of France, Germany and Switzerland, which PROJ's database package has.
constexpr const char* kSystems[] = {
    "EPSG:32601", "EPSG:32633", "EPSG:32760", "EPSG:5041",  "EPSG:3031", "EPSG:3413",  "EPSG:3857",
    "EPSG:3395",  "EPSG:3035",  "EPSG:6931",  "EPSG:5514",  "EPSG:2056", "EPSG:8857",  "EPSG:2154",
    "EPSG:5070",  "EPSG:2263",  "EPSG:27700", "EPSG:3832",  "EPSG:3994", "EPSG:2193",  "EPSG:4258",
    "EPSG:4277",  "EPSG:4275",  "EPSG:27572", "EPSG:31467", "EPSG:4314", "EPSG:21781",
};

/// The seed of a round, for repeating it alone.
class Round {
 public:
  explicit Round(std::uint64_t seed) : random_(seed) {}
  double unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  int below(std::size_t end) { return static_cast<int>(random_() % end); }
  template <class List>
  const auto& one_of(const List& list) {
    return list[below(std::size(list))];
  }
  /// Returns any place, or one where conversions are difficult: poles, antimeridian, edges and
  /// middles of zones, borders of grids.
  Point2 place() {
    static constexpr double kLongitudes[] = {-180, 180, 0, 3, 6, 9, 12, 15, 7.4, 2.3, -75};
    static constexpr double kLatitudes[] = {-90, 90, -80, 84, 0, 47, 49, 51, 55, 60};
    Point2 place{360 * unit() - 180, 180 * unit() - 90};
    if (unit() < 0.6) place[0] = one_of(kLongitudes);
    if (unit() < 0.6) place[1] = one_of(kLatitudes);
    const double near = std::pow(10, -6 * unit());
    return {place[0] + near * (unit() - 0.5),
            std::clamp(place[1] + near * (unit() - 0.5), -90.0, 90.0)};
  }

 private:
  std::mt19937_64 random_;
};

struct Checked {
  std::size_t places = 0, interpolated = 0, wrong = 0;
};

void compare(std::span<const Point2> truth, std::span<const Point2> found, Checked& checked) {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    ++checked.places;
    // Beyond a pole, only the latitude is NaN.
    if (std::isnan(truth[i][0]) || std::isnan(truth[i][1])) {
      checked.wrong += std::isnan(found[i][0]) || std::isnan(found[i][1]) ? 0U : 1U;
      continue;
    }
    checked.interpolated += found[i] == truth[i] ? 0U : 1U;
    const double turn = std::abs(std::remainder(found[i][0] - truth[i][0], 360.0));
    const double off = std::max(turn, std::abs(found[i][1] - truth[i][1]));
    checked.wrong += off <= kGeographyTolerance ? 0U : 1U;
  }
}

/// Boxes and windows of all sizes, from centimetres to continents.
TEST(Geography, StaysWithinToleranceInRandomSystems) {
  constexpr std::uint64_t kFirstSeed = 20261129, kRounds = 200 / TERRACE_TEST_SHARE;
  std::map<std::string, CoordinateSystem> systems;
  for (const char* const name : kSystems) systems.emplace(name, CoordinateSystem::parse(name));
  Checked boxes, grids;
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + kRounds; ++seed) {
    Round round(seed);
    const auto& [name, system] = *std::next(systems.begin(), round.below(systems.size()));
    const Point2 at = round.place();
    const Point2 centre = system.from_geographic(at);
    if (!std::isfinite(centre[0]) || !std::isfinite(centre[1])) continue;
    const double unit = system.is_geographic() ? 111e3 : system.metres_per_unit();
    const double size = std::pow(10, 9 * round.unit() - 2) / unit;
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": " << name << ", " << size * unit
                                    << " m around " << at[0] << ' ' << at[1]);
    std::vector<Point2> places(500);
    stream::Box3 box;
    for (Point2& p : places) {
      p = {centre[0] + size * (round.unit() - 0.5), centre[1] + size * (round.unit() - 0.5)};
      box.include(stream::Point3{p[0], p[1], 0});
    }
    const CoordinateSystem there = round.unit() < 0.5 ? system : system.over(box);
    std::vector<Point2> truth = places, found = places;
    there.to_geographic(truth);
    BoxGeography(there, box)(found);
    compare(truth, found, boxes);
    EXPECT_EQ(boxes.wrong, 0U);

    const double angle = round.unit() < 0.5 ? 0 : 6.3 * round.unit();
    const std::size_t columns = 1 + static_cast<std::size_t>(150 * round.unit()), rows = 40;
    const double cell = size / static_cast<double>(columns);
    const stream::WorldTransform world{{cell * std::cos(angle), cell * std::sin(angle), centre[0],
                                        cell * std::sin(angle), -cell * std::cos(angle),
                                        centre[1]}};
    const GridGeography grid(there, world);
    std::vector<double> longitude(columns * rows), latitude(columns * rows);
    grid.window(-20, -20, columns, rows, longitude, latitude);
    truth.clear();
    found.clear();
    for (std::size_t i = 0; i < columns * rows; i += 7) {
      truth.push_back(
          grid.place(static_cast<double>(i % columns) - 20, static_cast<double>(i / columns) - 20));
      found.push_back({longitude[i], latitude[i]});
    }
    compare(truth, found, grids);
    EXPECT_EQ(grids.wrong, 0U);
    if (boxes.wrong + grids.wrong > 0) return;
  }
  // Otherwise the test would compare exact places with themselves.
  EXPECT_GT(boxes.interpolated, boxes.places / 5);
  EXPECT_GT(grids.interpolated, grids.places / 5);
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
