// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "mesh/scene.hpp"
#include "picture/camera.hpp"

namespace terrace::tools {

using namespace terrain;

/// What is drawn on: colour and depth of samples, 2 x 2 to a pixel.
class Canvas {
 public:
  static constexpr std::uint32_t kOversampling = 2;

  /// width, height: of the final picture.
  Canvas(std::uint32_t width, std::uint32_t height);

  [[nodiscard]] std::uint32_t width() const { return width_; }    ///< in samples
  [[nodiscard]] std::uint32_t height() const { return height_; }  ///< in samples

  /// Colour (red, green, blue in 0 to 1) and depth of a sample; depth -infinity where nothing is.
  [[nodiscard]] std::array<float, 3>& colour(std::uint32_t x, std::uint32_t y) {
    return colours_[std::size_t{y} * width_ + x];
  }
  [[nodiscard]] float& depth(std::uint32_t x, std::uint32_t y) {
    return depths_[std::size_t{y} * width_ + x];
  }

  /// The picture: samples averaged, RGB, rows from the top.
  [[nodiscard]] std::vector<std::uint8_t> resolve() const;

 private:
  std::uint32_t width_, height_;
  std::vector<std::array<float, 3>> colours_;
  std::vector<float> depths_;
};

/// How surfaces are lit.
struct Light {
  stream::Point3 direction{};  ///< toward the light, unit length
  double relief = 1.0;         ///< slopes are multiplied by this before they are lit
  double flat = 0.0;           ///< the light on flat ground, which is shown as 1

  /// Cartographic light from the north-west, 45 degrees high, turned with the viewer.
  static Light for_terrain(const ViewDirection& view, double relief);
  /// A light beside the viewer, for bodies seen from any side.
  static Light beside(const Camera& camera);

  /// Brightness from 0 to 1 of a surface with that unit normal, seen from `toward` (the normal is
  /// turned to the viewer first: surfaces have two sides).
  [[nodiscard]] float shade(stream::Point3 normal, const stream::Point3& toward) const;
};

}  // namespace terrace::tools
