// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

/// Triangles linked to their neighbours. Shared by all TINs.

namespace terrace::tri::tin {

inline constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Side i is opposite to corner i, from corner i + 1 to corner i + 2.
struct Triangle {
  std::array<std::uint32_t, 3> corner;  ///< counter-clockwise; corner[0] == kNone: not a triangle
  std::array<std::uint32_t, 3> next;    ///< the triangle across side i, or kNone
  std::uint32_t place;                  ///< the sample or point with the greatest error
  float error;                          ///< positive while `place` waits to be inserted

  bool live() const { return corner[0] != kNone; }
};

using Triangles = std::vector<Triangle>;

/// Triangles with the coordinates of their corners. `Vertices` is an array of vertices.
template <class Vertices>
struct Mesh {
  Vertices vertices;
  Triangles triangles;

  const auto& vertex(const Triangle& triangle, unsigned i) const {
    return vertices[triangle.corner[i]];
  }
};

/// The place of a point in a mesh.
struct Spot {
  std::uint32_t triangle = kNone;  ///< contains the point; kNone: outside
  unsigned zeros = 0;              ///< number of its sides whose lines contain the point
  unsigned side = 0;               ///< one of these
  bool border = false;             ///< the point is on the mesh's border, between two vertices
};

/// The side that a walk tries first in each triangle. In a Delaunay triangulation a walk ends
/// whatever side that is.
struct LowestSide {
  explicit LowestSide(std::uint32_t) {}
  static unsigned next() { return 0; }
};
/// Varies, so that a walk cannot be endless in a mesh that is not Delaunay.
struct RandomSide {
  explicit RandomSide(std::uint32_t start) : random(start * 2654435761u + 1) {}
  unsigned next() {
    random = random * 1664525u + 1013904223u;
    return (random >> 16) % 3;
  }
  std::uint32_t random;
};

/// An error as stored in Triangle::error: rounded up, positive, finite.
inline float rounded_up(double error) {
  constexpr float kHighest = std::numeric_limits<float>::max();
  if (!(error < double{kHighest})) return kHighest;
  const auto rounded = static_cast<float>(error);
  return rounded < error || rounded == 0 ? std::nextafter(rounded, kHighest) : rounded;
}

/// Triangle::place for a sample in rows and columns, at most 65,535 of each.
inline constexpr std::uint32_t place_at(std::int32_t column, std::int32_t row) {
  return static_cast<std::uint32_t>(row) << 16 | static_cast<std::uint32_t>(column);
}
inline constexpr std::int32_t column_of(std::uint32_t place) {
  return static_cast<std::int32_t>(place & 0xFFFF);
}
inline constexpr std::int32_t row_of(std::uint32_t place) {
  return static_cast<std::int32_t>(place >> 16);
}

inline constexpr unsigned after(unsigned side) { return side == 2 ? 0 : side + 1; }
inline constexpr unsigned before(unsigned side) { return side == 0 ? 2 : side - 1; }

/// The side of `triangle` across which its neighbour `neighbour` is.
inline unsigned side_to(const Triangle& triangle, std::uint32_t neighbour) {
  return triangle.next[0] == neighbour ? 0 : triangle.next[1] == neighbour ? 1 : 2;
}

/// The index of `vertex` among the corners of `triangle`.
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
