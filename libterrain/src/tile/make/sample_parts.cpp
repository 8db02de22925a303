// SPDX-License-Identifier: Apache-2.0
#include "tile/make/sample_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace terrace::terrain {
namespace {

bool meet(const GeographicBox& a, const GeographicBox& b) {
  return a.west <= b.east && b.west <= a.east && a.south <= b.north && b.south <= a.north;
}

/// Removes the samples that belong to another part of `whole` as well.
void drop_elsewhere(const GeographicBox& part, const GeographicBox& whole,
                    SurfaceSamples& samples) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool elsewhere = (samples.longitude[i] == part.east && part.east != whole.east) ||
                           (samples.latitude[i] == part.north && part.north != whole.north);
    if (elsewhere) continue;
    samples.longitude[kept] = samples.longitude[i];
    samples.latitude[kept] = samples.latitude[i];
    samples.height[kept++] = samples.height[i];
  }
  samples.longitude.resize(kept);
  samples.latitude.resize(kept);
  samples.height.resize(kept);
}

}  // namespace

std::array<GeographicBox, 4> quarters_of(const GeographicBox& box) {
  const double middle = box.west + (box.east - box.west) / 2.0;
  const double centre = box.south + (box.north - box.south) / 2.0;
  return {{{box.west, box.south, middle, centre},
           {middle, box.south, box.east, centre},
           {box.west, centre, middle, box.north},
           {middle, centre, box.east, box.north}}};
}

bool may_have_samples(const GeographicBox& box, TileSurface& surface) {
  return meet(box, surface.bounds()) && surface.range(box).has_value();
}

bool is_to_be_cut(const GeographicBox& box, TileSurface& surface) {
  // Widen the box slightly, because leaves of tiles are rounded to units.
  return box.east - box.west > 1.01 * surface.widest_part() || surface.crowded(box);
}

void for_each_part(const GeographicBox& box, TileSurface& surface,
                   const std::function<void(const SurfaceSamples&)>& visit) {
  std::vector<GeographicBox> open{box};
  SurfaceSamples samples;
  while (!open.empty()) {
    surface.check_stop();
    const GeographicBox part = open.back();
    open.pop_back();
    if (!may_have_samples(part, surface)) continue;
    if (is_to_be_cut(part, surface)) {
      for (const GeographicBox& quarter : quarters_of(part)) open.push_back(quarter);
      continue;
    }
    surface.samples(part, samples);
    drop_elsewhere(part, box, samples);
    if (samples.size() > 0) visit(samples);
  }
}

std::vector<TileAddress> tiles_with_samples(TileSurface& surface, unsigned zoom,
                                            const Context& context) {
  std::vector<TileAddress> found, open{{0, 0, 0}, {0, 1, 0}};
  while (!open.empty()) {
    context.check_stop();
    const TileAddress tile = open.back();
    open.pop_back();
    // Here borders belong to one tile, so that samples on them alone do not make a tile.
    const TileRange wanted = tiles_in(surface.bounds(), tile.zoom);
    const bool inside =
        tile.x >= wanted.x0 && tile.x <= wanted.x1 && tile.y >= wanted.y0 && tile.y <= wanted.y1;
    if (!inside || !surface.range(box_of(tile))) continue;
    if (tile.zoom == zoom) {
      found.push_back(tile);
      continue;
    }
    for (const TileAddress& child : children_of(tile)) open.push_back(child);
  }
  std::sort(found.begin(), found.end(), by_row);
  return found;
}

}  // namespace terrace::terrain
