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
  std::string folder;  ///< created if missing
  std::string name{};  ///< in layer.json; empty: the store's name
  unsigned first_zoom = 0;
  std::optional<unsigned> last_zoom{};  ///< by default, the zoom that shows every sample
  /// Error bound in metres at the deepest zoom, doubled at each zoom above. By default the error
  /// that globes expect at each zoom: 77067 / 2^zoom.
  std::optional<double> max_error{};
  tri::TinQuality quality = tri::TinQuality::removal;
  HeightReference vertical = HeightReference::recorded;
  std::string geoid{};  ///< a geoid grid file of GeographicLib; overrides PROJ's
  /// Globes have no holes, so `none` is not allowed. `interpolate` fills voids within the convex
  /// outline of the data. Beyond it the surface is 0 m above the ellipsoid.
  Fill fill = Fill::interpolate;
  std::optional<double> flat_height{};  ///< height of Fill::flat, metres above the ellipsoid
  /// Adds a water mask: water is where there is no data, or where the height equals water_height
  /// (in the store's unit).
  bool water = false;
  std::optional<double> water_height{};
  bool normals = false;   ///< at the vertices, for lighting
  bool metadata = false;  ///< lists the tiles below each tile, in the tile
  bool gzip = false;
  bool resume = false;   ///< continues an interrupted run or repairs a finished set
  bool replace = false;  ///< the finished set may be from another store or options
};

struct TileZoom {
  unsigned zoom = 0;
  std::uint64_t tiles = 0;
  double max_error = 0.0;  ///< metres, verified at every sample
};

struct TilesOutcome {
  std::uint64_t tiles = 0, bytes = 0;
  std::uint64_t made = 0;     ///< rebuilt, because missing or out of date; included in `tiles`
  std::uint64_t kept = 0;     ///< kept, because complete and up to date; included in `tiles`
  std::uint64_t removed = 0;  ///< tiles of an earlier set that are not in this one
  std::vector<TileZoom> zooms;
};

/// Writes a tile set: quantized-mesh 1.0 tiles in the geographic tiling with two tiles at zoom 0,
/// and layer.json.
///
/// Each tile is within its zoom's bound of every sample, checked on the decoded tile. Where the 15
/// bits of a tile's coordinates are coarser than the bound, a note says so. The bytes do not depend
/// on the number of threads.
///
/// Tiles are written to temporary files next to their final names, renamed one by one and synced
/// together at the end, layer.json last. A journal stays in the folder and records for each tile a
/// hash of its inputs and the checksum of its file. A tile is kept if both still match, whether the
/// last run was interrupted or data changed elsewhere; a rebuilt tile that comes out the same is
/// not touched. The result is the same as in an empty folder. `resume` without `replace` is refused
/// for a finished set of other samples or options. The folder is locked against other runs. Files
/// that are not tiles stay. A tile that a finished set does not list is refused.
///
/// Memory: within the context's bound, at least 176 MiB. Reports "tiles". Throws: UsageError for
/// options that do not work together or with this store; stream::Error for a folder that contains
/// something else, a store that is damaged or has no place with a longitude and latitude, and
/// insufficient memory; stream::Stopped.
TilesOutcome write_tiles(const stream::Store& store, const TilesRequest& request,
                         const Context& context = {});

}  // namespace terrace::terrain
