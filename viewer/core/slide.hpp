// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "scene.hpp"

/// How the page moves a vertex into its place: from where it was to where it is, in kSlide seconds.

namespace terrace::viewer {

inline constexpr double kSlide = 0.45;
/// Bits of SceneBodyPoint::start without the sign; one is left for rounding.
inline constexpr int kStartBits = 14;

/// Returns where the page draws a vertex at a time.
template <class Vertex>
stream::Point3 position_at(const Vertex& v, double time) {
  const double t = std::clamp((time - v.start_time) / kSlide, 0.0, 1.0);
  const double remaining = 1 - t * t * (3 - 2 * t);
  stream::Point3 place{v.x, v.y, v.z};
  if constexpr (std::is_same_v<Vertex, SceneVertex>) {
    place[2] += remaining * (v.start_z - v.z);
  } else {
    for (std::size_t k = 0; k < 3; ++k)
      place[k] += remaining * std::ldexp(v.start[k], v.start_exponent);
  }
  return place;
}

/// Starts a vertex's slide.
template <class Vertex>
void start_slide(Vertex& v, const stream::Point3& from, const stream::Point3& to, double time) {
  v.x = static_cast<float>(to[0]);
  v.y = static_cast<float>(to[1]);
  v.z = static_cast<float>(to[2]);
  v.start_time = static_cast<float>(time);
  if constexpr (std::is_same_v<Vertex, SceneVertex>) {
    v.start_z = static_cast<float>(from[2]);
  } else {
    const stream::Point3 offset{from[0] - to[0], from[1] - to[1], from[2] - to[2]};
    int exponent = 0;
    std::frexp(std::max({std::abs(offset[0]), std::abs(offset[1]), std::abs(offset[2])}),
               &exponent);
    exponent = std::clamp(exponent - kStartBits, -128, 127);
    v.start_exponent = static_cast<std::int8_t>(exponent);
    for (std::size_t k = 0; k < 3; ++k) {
      v.start[k] = static_cast<std::int16_t>(std::lround(std::ldexp(offset[k], -exponent)));
    }
  }
}

}  // namespace terrace::viewer
