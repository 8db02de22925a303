// SPDX-License-Identifier: Apache-2.0
#include "tin/arrange.hpp"

#include "surface.hpp"

namespace terrace::tri::tin::rows {

void RowSurface::arrange() {
  const auto tile_of = [&](const Vertex& v) {
    const std::uint32_t sample = v.sample == kNone ? 0 : v.sample;
    return tiles_.of(static_cast<std::int32_t>(sample & 0xFFFF),
                     static_cast<std::int32_t>(sample >> 16));
  };
  // Those of the frame stay the first.
  std::vector<std::uint32_t> keys;
  keys.reserve(triangles_.size());
  for (std::uint32_t v = 0; v < vertices_.size(); ++v)
    keys.push_back(v < fixed_ ? 0 : tile_of(vertices_[v]) + 1);
  const std::vector<std::uint32_t> vertex_at = places_by(keys, tiles_.count() + 1);
  keys.clear();
  for (const Triangle& t : triangles_) keys.push_back(tile_of(vertex(t, 0)));
  const std::vector<std::uint32_t> triangle_at = places_by(keys, tiles_.count());
  move_to(vertex_at, triangle_at, vertices_, triangles_);
}

}  // namespace terrace::tri::tin::rows
