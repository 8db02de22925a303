// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid_surface.hpp"

namespace terrace::tri::tin {
namespace {

/// The places of elements once they are sorted by key; equal keys keep their order.
std::vector<std::uint32_t> places_by(const std::vector<std::uint32_t>& keys, std::size_t count) {
  std::vector<std::uint32_t> starts(count + 1, 0);
  for (const std::uint32_t key : keys) ++starts[key + 1];
  for (std::size_t i = 1; i <= count; ++i) starts[i] += starts[i - 1];
  std::vector<std::uint32_t> places;
  places.reserve(keys.size());
  for (const std::uint32_t key : keys) places.push_back(starts[key]++);
  return places;
}

}  // namespace

template <class T>
void GridSurface<T>::arrange() {
  std::vector<std::uint32_t> keys;
  keys.reserve(triangles_.size());
  for (const Corner& vertex : corners_) keys.push_back(tiles_.of(vertex.x, vertex.y));
  const std::vector<std::uint32_t> vertex_at = places_by(keys, tiles_.count());
  keys.clear();
  for (const Triangle& triangle : triangles_) {
    const Corner& vertex = corner(triangle, 0);
    keys.push_back(tiles_.of(vertex.x, vertex.y));
  }
  const std::vector<std::uint32_t> triangle_at = places_by(keys, tiles_.count());

  std::vector<Corner> corners(corners_.size());
  for (std::size_t i = 0; i < corners.size(); ++i) corners[vertex_at[i]] = corners_[i];
  corners_.swap(corners);
  Triangles triangles(triangles_.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Triangle& triangle = triangles[triangle_at[i]] = triangles_[i];
    for (std::uint32_t& vertex : triangle.corner) vertex = vertex_at[vertex];
    for (std::uint32_t& next : triangle.next)
      if (next != kNone) next = triangle_at[next];
  }
  triangles_.swap(triangles);
}

template void GridSurface<float>::arrange();
template void GridSurface<double>::arrange();

}  // namespace terrace::tri::tin
