// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tile/format/quantized_mesh.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

/// Samples against the surface of a tile.
struct TileHeights {
  std::uint64_t samples = 0;               ///< in the tile, its borders included
  std::uint64_t uncovered = 0;             ///< of these, in no triangle
  double max_error = 0.0;                  ///< metres, of the others
  double longitude = 0.0, latitude = 0.0;  ///< of a sample with that error

  /// Adds what was measured in another part of the tile.
  void add(const TileHeights& part);
};

/// Measures every sample in a part of a tile, which is the tile itself or one below it; samples on
/// an inner border count in the part east or north of it. They are read piece by piece. Memory: of
/// the samples of a piece, some 600 x 600, and of the tile. Throws: stream::Error on a damaged
/// store.
TileHeights measure_tile(const TileAddress& address, const TileMesh& mesh, TileSurface& surface,
                         const TileAddress& part);

/// Samples inside the borders of a tile, for tiles that are not there.
std::uint64_t count_samples(const TileAddress& address, TileSurface& surface);

}  // namespace terrace::terrain
