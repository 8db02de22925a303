// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer reads colour ramps and light from a file, which must match those of `terrace render`.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "picture/camera.hpp"
#include "picture/canvas.hpp"
#include "picture/color.hpp"

namespace terrace::tools {
namespace {

using Json = nlohmann::json;

Json viewer_ramps() {
  std::ifstream file(TERRACE_RAMPS);
  EXPECT_TRUE(file) << TERRACE_RAMPS;
  return Json::parse(file);
}

/// Returns the colour at a position between the stops, as ramps.ts computes it.
Rgb interpolate(const Json& stops, double position) {
  std::size_t next = 1;
  while (next + 1 < stops.size() && stops[next][0] < position) ++next;
  const double from = stops[next - 1][0], to = stops[next][0];
  const double t = std::clamp((position - from) / (to - from), 0.0, 1.0);
  Rgb colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double a = stops[next - 1][c + 1], b = stops[next][c + 1];
    colour[c] = static_cast<std::uint8_t>(std::lround((1 - t) * a + t * b));
  }
  return colour;
}

TEST(Ramps, ViewerMatchesTheCommand) {
  const Json ramps = viewer_ramps();
  for (int i = -10; i <= 1010; ++i) {
    const double share = i / 1000.0;
    EXPECT_EQ(land_colour(share), interpolate(ramps["land"], share)) << share;
    EXPECT_EQ(sea_colour(share), interpolate(ramps["sea"], share)) << share;
    EXPECT_EQ(slope_colour(60 * share), interpolate(ramps["slope"], 60 * share)) << share;
  }
  for (unsigned level = 0; level <= 8; ++level) {
    EXPECT_EQ(store_level_colour(level, 8), interpolate(ramps["levels"], 1 - level / 8.0)) << level;
  }
  EXPECT_EQ(store_level_colour(0, 0), interpolate(ramps["levels"], 1));
  const Json& categories = ramps["categories"];
  for (std::size_t i = 0; i < 3 * categories.size(); ++i) {
    EXPECT_EQ(Json(category_colour(static_cast<std::int64_t>(i))),
              categories[i % categories.size()])
        << i;
  }
  const Json& classes = ramps["classes"];
  for (std::size_t i = 0; i < 256; ++i) {
    EXPECT_EQ(Json(class_colour(static_cast<std::int64_t>(i))),
              i < classes.size() ? classes[i] : categories[i % categories.size()])
        << i;
  }
}

TEST(Ramps, ClassesHaveCustomaryColours) {
  const auto is_most = [](const Rgb& c, std::size_t channel) {
    return std::max_element(c.begin(), c.end()) - c.begin() == static_cast<std::ptrdiff_t>(channel);
  };
  const Rgb ground = class_colour(2), building = class_colour(6), road = class_colour(11);
  EXPECT_TRUE(ground[0] > ground[1] && ground[1] > ground[2]) << "ground is brown";
  int brightness = 766;
  for (const int vegetation : {3, 4, 5}) {  // the higher, the darker
    const Rgb c = class_colour(vegetation);
    EXPECT_TRUE(is_most(c, 1)) << vegetation;
    EXPECT_LT(c[0] + c[1] + c[2], brightness);
    brightness = c[0] + c[1] + c[2];
  }
  EXPECT_TRUE(is_most(building, 0) && building[0] > 2 * building[1]) << "buildings are red";
  EXPECT_TRUE(is_most(class_colour(9), 2)) << "water is blue";
  for (const int noise : {7, 18}) {
    const Rgb c = class_colour(noise);
    EXPECT_TRUE(c[0] > c[1] + 100 && c[2] > c[1] + 100) << "noise is magenta";
  }
  EXPECT_LE(std::max({road[0], road[1], road[2]}) - std::min({road[0], road[1], road[2]}), 20);
  EXPECT_EQ(class_colour(64), category_colour(64));
}

TEST(Ramps, ViewerLightMatchesTheCommand) {
  const Json light = viewer_ramps()["light"];
  const double radians = std::acos(-1.0) / 180;
  std::mt19937 random(16);
  std::uniform_real_distribution<double> slope(-2, 2);
  // In the viewer, an azimuth is the direction of view. In the command, it is where the viewer is.
  for (const double azimuth : {0.0, 30.0, 135.0, 270.0}) {
    const ViewDirection view{.azimuth = azimuth + 180, .elevation = 40};
    const Camera camera(view);
    const double turn = (azimuth + light["turn"].get<double>()) * radians;
    const double elevation = light["elevation"].get<double>() * radians;
    const stream::Point3 sun{std::sin(turn) * std::cos(elevation),
                             std::cos(turn) * std::cos(elevation), std::sin(elevation)};
    for (int i = 0; i < 200; ++i) {
      const double x = slope(random), y = slope(random), length = std::sqrt(x * x + y * y + 1);
      const stream::Point3 normal{x / length, y / length, 1 / length};
      const double facing = normal[0] * camera.toward[0] + normal[1] * camera.toward[1] +
                            normal[2] * camera.toward[2];
      if (facing < 0) continue;
      const double lit = normal[0] * sun[0] + normal[1] * sun[1] + normal[2] * sun[2];
      const double ambient = light["ambient"], strength = light["strength"];
      EXPECT_NEAR(Light::for_terrain(view, 1).shade(normal, camera.toward),
                  ambient + (1 - ambient) * strength * std::max(lit, 0.0) / sun[2], 1e-6)
          << azimuth << ": " << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace terrace::tools
