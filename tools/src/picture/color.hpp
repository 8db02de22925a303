// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace terrace::tools {

/// Red, green and blue of 255.
using Rgb = std::array<std::uint8_t, 3>;

/// Red, green and blue of 1.
inline std::array<float, 3> as_floats(const Rgb& colour) {
  return {static_cast<float>(colour[0]) / 255.0F, static_cast<float>(colour[1]) / 255.0F,
          static_cast<float>(colour[2]) / 255.0F};
}

/// Hypsometric tint: deep to high land as green, straw, brown, grey, white. share: 0 lowest, 1
/// highest; clamped.
Rgb land_colour(double share);
/// Sea floor: dark to light blue. share: 0 deepest, 1 at the surface.
Rgb sea_colour(double share);
/// Slope: white, yellow, red, dark red at 0, 15, 35 and 60 degrees and above.
Rgb slope_colour(double degrees);
/// Levels of a store: dark blue for the coarsest, `top`, to yellow for level 0.
Rgb store_level_colour(unsigned level, unsigned top);
/// Colours that differ well for small numbers: groups, clusters.
Rgb category_colour(std::int64_t category);
/// The classes of ASPRS LAS 1.4 as is customary: ground brown, vegetation green, buildings red,
/// water blue, noise magenta. Those that it does not define have the colours of categories.
Rgb class_colour(std::int64_t number);
/// The same for clusters, scattered, because consecutive numbers are not neighbours. Negative
/// numbers, points without a cluster, are light grey.
Rgb cluster_colour(std::int64_t cluster);

/// The range of heights that the tints span: without the outermost 0.5 % of what is shown on either
/// side, and with a shore at 0 where there is land and sea.
struct HeightTint {
  double low = 0.0, high = 1.0;
  bool shore = false;

  /// heights: each stands for an equal part of what is shown. Those that are not finite are
  /// ignored. O(n log n).
  static HeightTint of(std::vector<double> heights);
  [[nodiscard]] Rgb colour(double height) const;
};

}  // namespace terrace::tools
