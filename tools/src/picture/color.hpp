// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace terrace::tools {

/// Red, green and blue from 0 to 255.
using Rgb = std::array<std::uint8_t, 3>;

/// Returns red, green and blue from 0 to 1.
inline std::array<float, 3> as_floats(const Rgb& colour) {
  return {static_cast<float>(colour[0]) / 255.0F, static_cast<float>(colour[1]) / 255.0F,
          static_cast<float>(colour[2]) / 255.0F};
}

/// Returns the hypsometric tint of land, from low to high: green, straw, brown, grey, white.
/// `share` is 0 for the lowest and 1 for the highest land, and is clamped.
Rgb land_colour(double share);
/// Returns the tint of the sea floor, from dark to light blue. `share` is 0 for the deepest point
/// and 1 at the surface.
Rgb sea_colour(double share);
/// Returns the colour of a slope: white, yellow, red and dark red at 0, 15, 35 and from 60 degrees.
Rgb slope_colour(double degrees);
/// Returns the colour of a store's level, from dark blue for the coarsest, `top`, to yellow for
/// level 0.
Rgb store_level_colour(unsigned level, unsigned top);
/// Returns colours that are easy to tell apart for small numbers, such as groups or clusters.
Rgb category_colour(std::int64_t category);
/// Returns the customary colours of ASPRS LAS 1.4 classes: ground brown, vegetation green,
/// buildings red, water blue, noise magenta. Undefined classes use category_colour().
Rgb class_colour(std::int64_t number);
/// Returns category colours for clusters, in scattered order because consecutive numbers are not
/// neighbours. Negative numbers, points without a cluster, are light grey.
Rgb cluster_colour(std::int64_t cluster);

/// The height range of the tints. It excludes the lowest and the highest 0.5 % of the picture. If
/// there is both land and sea, a shore at 0 separates their tints.
struct HeightTint {
  double low = 0.0, high = 1.0;
  bool shore = false;

  /// Returns the range for `heights`, each of which represents an equal part of the picture.
  /// Ignores heights that are not finite. O(n log n).
  static HeightTint of(std::vector<double> heights);
  [[nodiscard]] Rgb colour(double height) const;
};

}  // namespace terrace::tools
