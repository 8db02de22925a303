// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// What TINs of rasters and of points share: triangles that know their neighbours, of vertices that
/// are numbers only. Nothing here computes with coordinates.

namespace terrace::tri::tin {

inline constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Side i is the one opposite to corner i, from corner i + 1 to corner i + 2.
struct Triangle {
  std::array<std::uint32_t, 3> corner;  ///< counter-clockwise; corner[0] == kNone: no triangle
  std::array<std::uint32_t, 3> next;    ///< the triangle across side i, or kNone
  std::uint32_t place;                  ///< the sample or point where the error is greatest
  float error;                          ///< > 0: waits for `place` to be inserted

  bool live() const { return corner[0] != kNone; }
};

using Triangles = std::vector<Triangle>;

inline constexpr unsigned after(unsigned side) { return side == 2 ? 0 : side + 1; }
inline constexpr unsigned before(unsigned side) { return side == 0 ? 2 : side - 1; }

/// The side of `triangle` that `neighbour` is across, which must be one of its neighbours.
inline unsigned side_to(const Triangle& triangle, std::uint32_t neighbour) {
  return triangle.next[0] == neighbour ? 0 : triangle.next[1] == neighbour ? 1 : 2;
}

/// The number of the corner that is `vertex`, which must be one of its corners.
inline unsigned corner_of(const Triangle& triangle, std::uint32_t vertex) {
  return triangle.corner[0] == vertex ? 0 : triangle.corner[1] == vertex ? 1 : 2;
}

/// A triangle of each vertex, or kNone for vertices without triangles.
inline std::vector<std::uint32_t> triangle_of_vertices(const Triangles& triangles,
                                                       std::size_t vertices) {
  std::vector<std::uint32_t> result(vertices, kNone);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (triangles[t].live())
      for (const std::uint32_t vertex : triangles[t].corner) result[vertex] = t;
  return result;
}

}  // namespace terrace::tri::tin
