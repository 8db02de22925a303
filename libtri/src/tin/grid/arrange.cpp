// SPDX-License-Identifier: Apache-2.0
#include "tin/arrange.hpp"

#include "surface.hpp"

namespace terrace::tri::tin {

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
  move_to(vertex_at, triangle_at, corners_, triangles_);
}

template void GridSurface<float>::arrange();
template void GridSurface<double>::arrange();

}  // namespace terrace::tri::tin
