// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "tile/format/quantized_mesh.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

/// The result of comparing samples with the surface of a tile.
struct TileHeights {
  std::uint64_t samples = 0;               ///< in the tile, its borders included
  std::uint64_t uncovered = 0;             ///< of these, in no triangle
  double max_error = 0.0;                  ///< of the others, in metres
  double longitude = 0.0, latitude = 0.0;  ///< of a sample with that error

  /// Adds the result of another part of the tile.
  void add(const TileHeights& part);
};

/// Measures every sample in a part of a tile, which is the tile itself or one below it. Samples on
/// an inner border count in the part east or north of it. Reads the samples piece by piece. Memory:
/// for the samples of a piece, about 600 x 600, and for the tile. Throws: stream::Error on a
/// damaged store.
TileHeights measure_tile(const TileAddress& address, const TileMesh& mesh, TileSurface& surface,
                         const TileAddress& part);

/// Counts the samples inside the borders of a tile, for missing tiles.
std::uint64_t count_samples(const TileAddress& address, TileSurface& surface);

}  // namespace terrace::terrain
