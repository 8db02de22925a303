// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_rows_surface.hpp"

namespace terrace::tri::tin::rows {
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

  std::vector<Vertex> vertices(vertices_.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[vertex_at[i]] = vertices_[i];
  vertices_.swap(vertices);
  Triangles triangles(triangles_.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Triangle& triangle = triangles[triangle_at[i]] = triangles_[i];
    for (std::uint32_t& vertex : triangle.corner) vertex = vertex_at[vertex];
    for (std::uint32_t& next : triangle.next)
      if (next != kNone) next = triangle_at[next];
  }
  triangles_.swap(triangles);
}

}  // namespace terrace::tri::tin::rows
