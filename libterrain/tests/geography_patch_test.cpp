// SPDX-License-Identifier: Apache-2.0
#include "earth/geography_patch.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

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
      wrong += off <= BoxGeography::kTolerance ? 0 : 1;
      // The result does not depend on the other places.
      Point2 alone = places[i];
      geography(std::span(&alone, 1));
      EXPECT_EQ(alone, found[i]);
    }
    EXPECT_EQ(wrong, 0U);
  }
}

}  // namespace
}  // namespace terrace::terrain
