// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/color.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <terrace/base/random.hpp>

namespace terrace::tools {
namespace {

struct ColourStop {
  double position;
  Rgb colour;
};

Rgb ramp(std::span<const ColourStop> stops, double position) {
  if (!(position > stops.front().position)) return stops.front().colour;
  for (std::size_t i = 1; i < stops.size(); ++i) {
    if (position > stops[i].position) continue;
    const double t =
        (position - stops[i - 1].position) / (stops[i].position - stops[i - 1].position);
    Rgb mixed{};
    for (std::size_t c = 0; c < 3; ++c) {
      mixed[c] = static_cast<std::uint8_t>(
          std::lround((1 - t) * stops[i - 1].colour[c] + t * stops[i].colour[c]));
    }
    return mixed;
  }
  return stops.back().colour;
}

}  // namespace

Rgb land_colour(double share) {
  static constexpr std::array<ColourStop, 7> kLand{{{0.00, {96, 145, 92}},
                                                    {0.18, {150, 178, 110}},
                                                    {0.36, {212, 201, 140}},
                                                    {0.54, {196, 160, 105}},
                                                    {0.70, {160, 122, 92}},
                                                    {0.85, {178, 166, 158}},
                                                    {1.00, {250, 250, 250}}}};
  return ramp(kLand, share);
}

Rgb sea_colour(double share) {
  static constexpr std::array<ColourStop, 4> kSea{
      {{0.0, {20, 42, 92}}, {0.5, {44, 92, 150}}, {0.85, {104, 160, 202}}, {1.0, {168, 208, 228}}}};
  return ramp(kSea, share);
}

Rgb slope_colour(double degrees) {
  static constexpr std::array<ColourStop, 4> kSlope{
      {{0, {250, 250, 245}}, {15, {250, 215, 110}}, {35, {205, 70, 45}}, {60, {75, 15, 30}}}};
  return ramp(kSlope, degrees);
}

Rgb store_level_colour(unsigned level, unsigned top) {
  static constexpr std::array<ColourStop, 5> kLevels{{{0.00, {68, 34, 112}},
                                                      {0.25, {49, 104, 142}},
                                                      {0.50, {53, 183, 121}},
                                                      {0.75, {180, 221, 44}},
                                                      {1.00, {253, 231, 80}}}};
  return ramp(kLevels, top > 0 ? 1 - static_cast<double>(level) / top : 1);
}

Rgb category_colour(std::int64_t category) {
  // Based on P. Green-Armytage's set of many distinct colours, reduced to twelve of medium
  // lightness.
  static constexpr std::array<Rgb, 12> kCategories{{{68, 119, 170},
                                                    {238, 153, 51},
                                                    {51, 153, 85},
                                                    {204, 68, 85},
                                                    {136, 102, 187},
                                                    {153, 119, 68},
                                                    {221, 136, 187},
                                                    {119, 119, 119},
                                                    {170, 170, 51},
                                                    {85, 187, 204},
                                                    {34, 85, 51},
                                                    {136, 34, 51}}};
  const auto count = static_cast<std::int64_t>(kCategories.size());
  return kCategories[static_cast<std::size_t>(((category % count) + count) % count)];
}

Rgb class_colour(std::int64_t number) {
  static constexpr std::array<Rgb, 23> kClasses{{
      {190, 190, 190},  // never classified
      {150, 150, 150},  // unclassified
      {152, 104, 64},   // ground
      {168, 208, 96},   // low vegetation
      {96, 176, 72},    // medium vegetation
      {32, 120, 48},    // high vegetation
      {224, 80, 48},    // building
      {216, 32, 200},   // low point
      {200, 152, 96},   // model key
      {48, 112, 208},   // water
      {112, 88, 120},   // rail
      {100, 100, 110},  // road
      {240, 216, 72},   // overlap
      {176, 136, 208},  // wire guard
      {128, 88, 184},   // wire conductor
      {72, 56, 136},    // transmission tower
      {208, 176, 232},  // wire connector
      {184, 96, 112},   // bridge deck
      {255, 120, 232},  // high noise
      {144, 160, 184},  // overhead structure
      {116, 84, 60},    // ignored ground
      {216, 236, 248},  // snow
      {70, 70, 70},     // temporal exclusion
  }};
  if (number < 0 || number >= static_cast<std::int64_t>(kClasses.size())) {
    return category_colour(number);
  }
  return kClasses[static_cast<std::size_t>(number)];
}

Rgb cluster_colour(std::int64_t cluster) {
  if (cluster < 0) return {200, 200, 200};
  const std::uint64_t scattered = base::splitmix64(static_cast<std::uint64_t>(cluster));
  Rgb colour = category_colour(static_cast<std::int64_t>(scattered >> 8));
  // Use five shades, so that adjacent clusters rarely look alike.
  const double shade = 0.7 + 0.12 * static_cast<double>(scattered % 5);
  for (std::uint8_t& c : colour) c = static_cast<std::uint8_t>(std::min(255.0, shade * c));
  return colour;
}

HeightTint HeightTint::of(std::vector<double> heights) {
  std::erase_if(heights, [](double height) { return !std::isfinite(height); });
  if (heights.empty()) return {};
  std::sort(heights.begin(), heights.end());
  HeightTint tint;
  const std::size_t outer = heights.size() / 200;
  tint.low = heights[outer];
  tint.high = heights[heights.size() - 1 - outer];
  // Show a shore only if much of the picture is sea: beaches and polders are below 0 too.
  tint.shore = tint.low < 0 && tint.high > 0 && -tint.low > 0.05 * tint.high;
  return tint;
}

Rgb HeightTint::colour(double height) const {
  if (shore && height < 0) return sea_colour((height - low) / -low);
  const double bottom = shore ? 0 : low;
  return high > bottom ? land_colour((height - bottom) / (high - bottom)) : land_colour(0.3);
}

}  // namespace terrace::tools
