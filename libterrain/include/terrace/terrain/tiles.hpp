// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/grid_tin.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/fill.hpp"
#include "terrace/terrain/height_reference.hpp"

/// Sets of quantized-mesh tiles, which web globes stream.

namespace terrace::terrain {

struct TilesRequest {
  std::string folder;  ///< made if it is not there
  std::string name{};  ///< in layer.json; empty: the store's
  unsigned first_zoom = 0;
  std::optional<unsigned> last_zoom{};  ///< without a value, the zoom that shows every sample
  /// Metres at the deepest zoom; twice as much at each zoom above. Without a value, what globes
  /// expect of each zoom: 77067 / 2^zoom.
  std::optional<double> max_error{};
  tri::TinQuality quality = tri::TinQuality::kRemoval;
  HeightReference vertical = HeightReference::recorded;
  std::string geoid{};  ///< file of a geoid grid of GeographicLib, overrides PROJ's
  /// Globes have no holes: not `none`. `interpolate` fills voids within the convex outline of the
  /// data; beyond it the surface is at 0 m above the ellipsoid.
  Fill fill = Fill::interpolate;
  std::optional<double> flat_height{};  ///< of Fill::flat, metres above the ellipsoid
  /// A mask of water: where there is no data, or where the height is this one (store's unit).
  bool water = false;
  std::optional<double> water_height{};
  bool normals = false;   ///< at the vertices, for lighting
  bool metadata = false;  ///< the tiles below each tile, in the tile
  bool gzip = false;
  bool resume = false;   ///< goes on with an interrupted run, or mends a finished set
  bool replace = false;  ///< a finished set may be of another store or other options
};

struct TileZoom {
  unsigned zoom = 0;
  std::uint64_t tiles = 0;
  double max_error = 0.0;  ///< metres, verified at every sample
};

struct TilesOutcome {
  std::uint64_t tiles = 0, bytes = 0;
  std::uint64_t made = 0;     ///< of these, rebuilt: missing before, or out of date
  std::uint64_t kept = 0;     ///< of these, kept: their files were whole and up to date
  std::uint64_t removed = 0;  ///< tiles of an earlier set that this one does not have
  std::vector<TileZoom> zooms;
};

/// Writes a tile set: quantized-mesh 1.0 tiles in the geographic tiling of two tiles at zoom 0, and
/// layer.json.
///
/// Each tile is within its zoom's bound of every sample, checked on what a client decodes; where
/// the 15 bits of a tile's coordinates are coarser than the bound, a note says so. The bytes do not
/// depend on the number of threads.
///
/// Tiles are written beside their names and renamed one by one, and synced together at the end;
/// layer.json comes last. A journal stays in the folder and records for each tile a hash of what it
/// was made from and the checksum of its file. A tile for which both still hold is kept, whether
/// the last run was interrupted or data changed elsewhere; one that is rebuilt and comes out the
/// same is not touched. The result is the same as in an empty folder. `resume` without `replace` is
/// refused for a finished set of other samples or options. The folder is locked against other runs.
/// Files that are not tiles stay. A tile that a finished set does not list is refused.
///
/// Memory: within the context's bound, at least 176 MiB. Reports "tiles". Throws: UsageError for
/// options that do not go together or not with this store; stream::Error for a folder that holds
/// something else, a store that is damaged or has no place with a longitude and latitude, and too
/// little memory; stream::Stopped.
TilesOutcome write_tiles(const stream::Store& store, const TilesRequest& request,
                         const Context& context = {});

}  // namespace terrace::terrain
