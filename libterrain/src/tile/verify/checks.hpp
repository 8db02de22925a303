// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "tile/format/address.hpp"
#include "tile/format/layer.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// The files of a tile set in its folder.
struct TileInventory {
  /// The existing tiles per zoom, sorted by row, then column.
  std::vector<std::vector<TileAddress>> tiles;
  std::vector<stream::Problem> problems;
  /// Temporary files of a killed run, which are not part of the set.
  std::uint64_t torn = 0;
};

/// Compares layer.json with the files: each listed tile must exist, and each existing tile must be
/// listed once. Throws: stream::Error if the folder cannot be read; stream::Stopped.
TileInventory take_inventory(const std::string& folder, const TileLayer& layer,
                             const Context& context);

/// A fault in a tile, and its byte. Bytes of a compressed tile are counted after decompression.
struct TileFault {
  std::uint64_t offset = 0;
  std::string what;
};

/// Checks a tile without its neighbours. Triangles must be counter-clockwise, have an area and
/// cover the square once. All corners must exist, and no vertex may be unused. Lists of border
/// vertices must be exact and sorted. Sphere, centre and horizon occlusion point of the header must
/// be sound. Normals must point upward. The tile must have exactly the extensions that `extensions`
/// (of layer.json) promises. Reports the first fault of each kind and counts them all. O(n log n).
std::vector<TileFault> check_tile_mesh(const TileAddress& address, const DecodedTile& tile,
                                       const std::vector<std::string>& extensions);

/// The result of comparing samples with the surface of a tile.
struct TileHeights {
  std::uint64_t samples = 0;               ///< in the tile, its borders included
  std::uint64_t uncovered = 0;             ///< number of these samples in no triangle
  double max_error = 0.0;                  ///< largest error of the others, in metres
  double longitude = 0.0, latitude = 0.0;  ///< position of a sample with that error

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
