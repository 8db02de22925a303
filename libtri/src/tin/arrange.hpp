// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh.hpp"

/// Putting what is near each other near each other in memory.

namespace terrace::tri::tin {

/// The places of elements once they are sorted by key; equal keys keep their order.
inline std::vector<std::uint32_t> places_by(const std::vector<std::uint32_t>& keys,
                                            std::size_t count) {
  std::vector<std::uint32_t> starts(count + 1, 0);
  for (const std::uint32_t key : keys) ++starts[key + 1];
  for (std::size_t i = 1; i <= count; ++i) starts[i] += starts[i - 1];
  std::vector<std::uint32_t> places;
  places.reserve(keys.size());
  for (const std::uint32_t key : keys) places.push_back(starts[key]++);
  return places;
}

/// Moves vertices and triangles to their places.
template <class Vertex>
void move_to(const std::vector<std::uint32_t>& vertex_at,
             const std::vector<std::uint32_t>& triangle_at, std::vector<Vertex>& vertices,
             Triangles& triangles) {
  std::vector<Vertex> moved(vertices.size());
  for (std::size_t i = 0; i < moved.size(); ++i) moved[vertex_at[i]] = vertices[i];
  vertices.swap(moved);
  Triangles arranged(triangles.size());
  for (std::size_t i = 0; i < arranged.size(); ++i) {
    Triangle& triangle = arranged[triangle_at[i]] = triangles[i];
    for (std::uint32_t& vertex : triangle.corner) vertex = vertex_at[vertex];
    for (std::uint32_t& next : triangle.next)
      if (next != kNone) next = triangle_at[next];
  }
  triangles.swap(arranged);
}

}  // namespace terrace::tri::tin
