// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "terrace/tri/interpolation.hpp"

namespace terrace::tri {

/// Maximum number of vertices of a triangulation, in the plane or in space.
inline constexpr std::uint32_t kMaxVertices = (std::uint32_t{1} << 29) - 2;

/// Throws std::invalid_argument naming the first point that the kernel cannot accept.
template <class Kernel, class Coord, std::size_t kDimension>
void check_points(std::span<const std::array<Coord, kDimension>> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (Kernel::valid(points[i])) continue;
    std::string text = "point " + std::to_string(i) + ": coordinates ";
    for (std::size_t k = 0; k < kDimension; ++k)
      text += (k == 0 ? "" : ", ") + std::to_string(points[i][k]);
    throw std::invalid_argument(
        text +
        (std::is_integral_v<Coord> ? " are not in the range 0 <= c < 2^30; move or scale the points"
                                   : " are not finite; leave such points out"));
  }
}

/// Throws std::length_error if there would be too many vertices.
inline void check_count(std::size_t present, std::size_t added) {
  if (added <= kMaxVertices - present) return;
  throw std::length_error("a triangulation holds at most 2^29 - 2 vertices; " +
                          std::to_string(present) + " exist and " + std::to_string(added) +
                          " are added");
}

/// Throws std::invalid_argument if an array of heights is too short.
template <class Coord>
void check_heights(const Delaunay2<Coord>& triangulation, const Heights& heights) {
  if (heights.slots() >= triangulation.vertex_slots()) return;
  throw std::invalid_argument("heights: " + std::to_string(heights.slots()) +
                              " values for vertices in " +
                              std::to_string(triangulation.vertex_slots()) +
                              " slots; give as many as vertex_slots(), indexed by slot()");
}

}  // namespace terrace::tri
