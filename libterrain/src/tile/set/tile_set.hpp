// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <terrace/stream/file_lock.hpp>

#include "terrace/terrain/context.hpp"
#include "tile/format/tile_layer.hpp"
#include "tile/make/tile_mesher.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

struct TileSetOptions {
  std::string folder;
  std::string name;  ///< in layer.json
  unsigned first_zoom = 0, last_zoom = 0;
  /// The bound at the deepest zoom, metres; twice as much at each zoom above. 0: what the client
  /// expects of each zoom.
  double max_error = 0.0;
  TileMeshOptions mesh;
  bool gzip = false;
  bool metadata = false;  ///< the tiles below each tile, in the tile
  bool resume = false;    ///< goes on with an interrupted run, or mends a finished set
  bool replace = false;   ///< a finished set may be another one
  /// What of the store and of the options that the surfaces depend on the whole set depends on.
  std::string source_fingerprint, source_options;
};

struct ZoomSummary {
  unsigned zoom = 0;
  std::uint64_t tiles = 0;
  double max_error = 0.0;  ///< verified, metres
};

struct TileSetResult {
  std::uint64_t tiles = 0, bytes = 0;
  std::uint64_t made = 0;     ///< of these, that were not known to be there and the same
  std::uint64_t kept = 0;     ///< of these, whose files were whole and the same: not touched
  std::uint64_t removed = 0;  ///< tiles of an earlier set that this one does not have
  std::vector<ZoomSummary> zooms;
};

/// The bound of a zoom by the options.
double max_error_of(const TileSetOptions& options, unsigned zoom);
/// The zoom at which a 64th of a tile is not wider than the distance of samples.
unsigned native_zoom(double spacing);

/// Writes a tile set into a TileFolder. surfaces: one per thread, all of the same samples.
///
/// Tiles are written beside their names and renamed one by one, and the disk is asked once, at the
/// end, to keep them all; layer.json comes last. The bytes do not depend on the number of threads.
///
/// A journal stays in the folder and says of each tile what it was made from (digest_of()) and the
/// checksum of its file. A tile for which both are as they were is not made again, be it that the
/// run before was interrupted or that samples changed elsewhere; one that is made again and comes
/// out the same is not touched. So the folder is the same as if it had been empty before.
/// `resume` without `replace` is refused for a finished set of other samples or options.
/// Throws: stream::Error, stream::Stopped, UsageError for options that do not go together.
TileSetResult write_tile_set(const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                             const TileSetOptions& options, const Context& context);

/// The folder of a tile set for as long as a run writes to it: made if need be, and locked against
/// other runs.
class TileFolder {
 public:
  /// `folder` may be written if it is not there, or empty, or `force` and a tile set of ours, or
  /// `resume` and a begun one, and no other run writes to it. Throws: stream::Error with the
  /// remedy.
  TileFolder(const std::string& folder, bool force, bool resume);
  /// A folder that was made here and stayed empty goes.
  ~TileFolder();
  TileFolder(const TileFolder&) = delete;
  TileFolder& operator=(const TileFolder&) = delete;

  /// Where links lead.
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool made_ = false;
  stream::FileLock lock_;
};

}  // namespace terrace::terrain
