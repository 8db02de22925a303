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

/// The drawing surface: colour and depth of samples, with 2 x 2 samples per pixel.
class Canvas {
 public:
  static constexpr std::uint32_t kOversampling = 2;

  /// `width` and `height` are those of the final picture, in pixels. Throws: stream::Stopped.
  Canvas(std::uint32_t width, std::uint32_t height);

  [[nodiscard]] std::uint32_t width() const { return width_; }    ///< number of samples
  [[nodiscard]] std::uint32_t height() const { return height_; }  ///< number of samples

  /// Returns the colour of a sample: red, green and blue from 0 to 1.
  [[nodiscard]] std::array<float, 3>& colour(std::uint32_t x, std::uint32_t y) {
    return colours_[std::size_t{y} * width_ + x];
  }
  /// Returns the depth of a sample in metres toward the viewer; -infinity if it is empty.
  [[nodiscard]] float& depth(std::uint32_t x, std::uint32_t y) {
    return depths_[std::size_t{y} * width_ + x];
  }

  /// Returns the picture: averaged samples as RGB bytes, rows from the top. Throws:
  /// stream::Stopped.
  [[nodiscard]] std::vector<std::uint8_t> resolve() const;

 private:
  std::uint32_t width_, height_;
  std::vector<std::array<float, 3>> colours_;
  std::vector<float> depths_;
};

/// Lighting of surfaces.
struct Light {
  stream::Point3 direction{};  ///< toward the light, unit length
  double relief = 1.0;         ///< factor applied to slopes before lighting
  double flat = 0.0;           ///< brightness of flat ground, displayed as 1

  /// Returns cartographic light from the north-west, 45 degrees high, that turns with the viewer.
  static Light for_terrain(const ViewDirection& view, double relief);
  /// Returns a light at the viewer, slightly above and to the left, for bodies seen from any side.
  static Light headlight(const Camera& camera);

  /// Returns the brightness, from 0 to 1, of a surface with that unit normal seen from `toward`.
  /// The normal is first turned to the viewer, because surfaces have two sides.
  [[nodiscard]] float shade(stream::Point3 normal, const stream::Point3& toward) const;
};

}  // namespace terrace::tools
