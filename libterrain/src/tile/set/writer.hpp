// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/tiles.hpp"
#include "tile/format/layer.hpp"
#include "tile/make/mesher.hpp"
#include "tile/set/journal.hpp"

namespace terrace::terrain {

/// A request, and the values derived from it and the store.
struct TileSetOptions {
  const TilesRequest& request;
  std::string folder;  ///< with links resolved
  unsigned last_zoom = 0;
  std::string source_options;  ///< the options that the surface depends on

  [[nodiscard]] TileMeshOptions mesh() const {
    return {request.quality, request.normals, request.water};
  }
  /// The bound of a zoom, in metres.
  [[nodiscard]] double max_error(unsigned zoom) const;
};

/// Writes the tiles of one folder. Keeps files that are complete and up to date. Removes
/// `layer.json` before any change, so that an unfinished set does not have it.
class TileSetWriter {
 public:
  TileSetWriter(const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                const TileSetOptions& options, const Context& context,
                const std::string& layer_path)
      : surfaces_(surfaces),
        options_(options),
        context_(context),
        layer_path_(layer_path),
        journal_(options.folder) {
    if (std::filesystem::exists(layer_path)) finished_ = read_layer(layer_path);
    present.resize(options.last_zoom + 1);
  }

  /// Throws: stream::Error if a finished set has a tile that terrace did not write. Reads the names
  /// in the folder.
  void check_strangers() const;
  void write_zooms();
  /// Removes tiles of an earlier set that are not in this one, and temporary files of killed runs.
  /// Completes the journal. Call it after all zooms.
  void finish();

  TilesOutcome result;
  std::vector<std::vector<TileAddress>> present;  ///< per zoom, sorted by row, then column

 private:
  /// The outcome of one tile.
  struct Written {
    bool made = false;  ///< otherwise its record was up to date
    bool kept = false;  ///< its file was not touched
    FinishedTile finished;
  };
  struct Zoom {
    std::vector<TileAddress> tiles;  ///< those that may have data, sorted by row, then column
    double range = 0.0;              ///< range of heights that a tile's steps must cover
    ZoomPlan plan;
    SharedSides sides{kMaxSharedVertices};
    bool open = true;                           ///< its tiles remain to be written
    std::atomic<bool> range_too_large = false;  ///< a tile needs larger steps of height
    std::vector<Written> written;               ///< by tile
  };
  /// Tiles that a thread writes one after another: a tile and those below it, each after its
  /// children, so that most of the data decoded for one serves the next.
  using Family = std::vector<std::pair<Zoom*, std::size_t>>;

  void begin_zooms();
  /// Returns the families in stages. The families of a stage may be written at once, after the
  /// previous stage.
  std::vector<std::vector<Family>> stages();
  /// Adds the tiles below a tile by families of the zoom `last`, and the tiles above that zoom one
  /// by one, each after its children. So threads work close to each other at any time.
  void add_families(std::vector<Family>& stage, std::size_t zoom, std::size_t number,
                    std::size_t last);
  /// Adds a tile, after the tiles of open zooms below it.
  void add_to(Family& family, std::size_t zoom, std::size_t number);
  void write(const Family& family, TileSurface& surface,
             const std::function<void(const TileAddress&, const Written&)>& done);
  Written write_tile(const TileAddress& tile, Zoom& zoom, TileSurface& surface);
  /// Returns the tiles of the next zoom below a tile, as its metadata list them.
  [[nodiscard]] std::string children_json(const TileAddress& tile) const;
  void take_larger_steps(Zoom& zoom);
  void conclude(const Zoom& zoom);
  void remove_others();
  void begin_change();
  /// Whether another program put the tile into a finished set, so that neither the journal nor
  /// layer.json lists it. Always false for an unfinished set, where the last tiles may be unlisted.
  [[nodiscard]] bool is_stranger(const TileAddress& tile) const;

  const std::vector<std::unique_ptr<TileSurface>>& surfaces_;
  const TileSetOptions& options_;
  const Context& context_;
  const std::string& layer_path_;
  std::optional<TileLayer> finished_;  ///< the earlier finished set
  TileJournal journal_;
  std::vector<TileJournal::Record> records_;
  std::vector<std::unique_ptr<Zoom>> zooms_;  ///< from the first requested one on
  bool repeats_ = false;                      ///< tiles of this run are written again
  std::once_flag changed_;
};

}  // namespace terrace::terrain
