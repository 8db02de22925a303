// SPDX-License-Identifier: Apache-2.0
#include "tile/set/tile_candidates.hpp"

#include <algorithm>
#include <utility>

namespace terrace::terrain {

std::vector<TileAddress> tiles_with_samples(TileSurface& surface, unsigned zoom,
                                            const Context& context) {
  std::vector<TileAddress> found, open{{0, 0, 0}, {0, 1, 0}};
  while (!open.empty()) {
    context.check_stop();
    const TileAddress tile = open.back();
    open.pop_back();
    // Borders belong to one tile here, so that what lies on them alone makes none.
    const TileRange wanted = tiles_in(surface.bounds(), tile.zoom);
    const bool inside =
        tile.x >= wanted.x0 && tile.x <= wanted.x1 && tile.y >= wanted.y0 && tile.y <= wanted.y1;
    if (!inside || !surface.range(box_of(tile))) continue;
    if (tile.zoom == zoom) {
      found.push_back(tile);
      continue;
    }
    for (unsigned quarter = 0; quarter < 4; ++quarter) {
      open.push_back({tile.zoom + 1, 2 * tile.x + (quarter & 1), 2 * tile.y + (quarter >> 1)});
    }
  }
  std::sort(found.begin(), found.end(), [](const TileAddress& a, const TileAddress& b) {
    return std::pair{a.y, a.x} < std::pair{b.y, b.x};
  });
  return found;
}

}  // namespace terrace::terrain
