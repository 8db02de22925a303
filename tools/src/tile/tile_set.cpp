// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/tile_set.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>
#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "interrupt.hpp"
#include "ordered_work.hpp"
#include "progress.hpp"
#include "tile/tile_candidates.hpp"
#include "tile/tile_file.hpp"
#include "tile/tile_journal.hpp"
#include "units.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLayerName = "layer.json";

/// Tiles that may have data, sorted by row, then column. The two of zoom 0 always count.
std::vector<TileAddress> candidates(unsigned zoom, TileSurface& surface) {
  if (zoom == 0) return {{0, 0, 0}, {0, 1, 0}};
  return tiles_with_samples(surface, zoom);
}

/// The largest difference of heights within a tile, as far as it is known without reading.
double widest_range(const std::vector<TileAddress>& tiles, TileSurface& surface) {
  double widest = 0.0;
  for (const TileAddress& tile : tiles) {
    if (const auto range = surface.range(box_of(tile))) {
      widest = std::max(widest, range->high - range->low);
    }
  }
  return widest;
}

/// The tiles of the next zoom below a tile, as its metadata tells them.
std::string children_json(const TileAddress& tile, const std::set<TileAddress>& deeper) {
  std::vector<TileAddress> there;
  for (std::uint32_t y = 2 * tile.y; y <= 2 * tile.y + 1; ++y) {
    for (std::uint32_t x = 2 * tile.x; x <= 2 * tile.x + 1; ++x) {
      if (deeper.contains({tile.zoom + 1, x, y})) there.push_back({tile.zoom + 1, x, y});
    }
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const TileRange& range : ranges_of(there)) {
    list.push_back(
        {{"startX", range.x0}, {"startY", range.y0}, {"endX", range.x1}, {"endY", range.y1}});
  }
  return nlohmann::ordered_json{{"available", {list}}}.dump();
}

/// What became of a tile.
struct Written {
  bool present = false, kept = false;
  FinishedTile finished;
};

/// Writes the tiles of one folder, zoom by zoom.
class TileSetWriter {
 public:
  TileSetWriter(const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                const TileSetOptions& options, const CommonOptions& common,
                const std::string& fingerprint)
      : surfaces_(surfaces),
        options_(options),
        common_(common),
        journal_(options.folder, fingerprint, options.resume) {}

  /// The deepest first: its tiles are named in the metadata of those above.
  void write_zoom(unsigned zoom);

  TileSetResult result;
  std::vector<std::vector<TileAddress>> present;  ///< per zoom

 private:
  void write_tiles(const ZoomPlan& plan, const std::vector<TileAddress>& tiles);
  Written write_tile(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface) const;

  const std::vector<std::unique_ptr<TileSurface>>& surfaces_;
  const TileSetOptions& options_;
  const CommonOptions& common_;
  TileJournal journal_;
  std::set<TileAddress> deeper_;
};

Written TileSetWriter::write_tile(const TileAddress& tile, const ZoomPlan& plan,
                                  TileSurface& surface) const {
  check_interrupt();
  const std::string path = options_.folder + "/" + tile_path(tile);
  const std::vector<std::byte> before = read_tile_file(path);
  if (const FinishedTile* earlier = journal_.find(tile);
      earlier != nullptr && earlier->height_step == plan.height_step &&
      before.size() == earlier->bytes && !before.empty() &&
      checksum_of(before) == earlier->checksum) {
    return {true, true, *earlier};
  }
  MadeTile made = make_tile(tile, plan, surface, options_.mesh);
  if (!made.has_data && tile.zoom > 0) return {};
  if (options_.metadata) made.mesh.metadata = children_json(tile, deeper_);
  std::vector<std::byte> bytes = encode_tile(made.mesh, made.header);
  if (options_.gzip) bytes = stream::gzip(bytes);
  Written written{
      true, bytes == before, {bytes.size(), checksum_of(bytes), made.max_error, plan.height_step}};
  if (!written.kept) write_tile_file(path, bytes);
  return written;
}

void TileSetWriter::write_tiles(const ZoomPlan& plan, const std::vector<TileAddress>& tiles) {
  std::vector<TileAddress> there;
  ZoomSummary summary{.zoom = plan.zoom};
  TileSetResult added;
  ProgressMeter meter(common_.progress, "tiles");
  in_order(
      tiles.size(), static_cast<unsigned>(surfaces_.size()),
      [&](unsigned worker, std::size_t i) {
        return write_tile(tiles[i], plan, *surfaces_[worker]);
      },
      [&](std::size_t i, const Written& written) {
        meter.update(result.tiles + i,
                     static_cast<double>(i + 1) / static_cast<double>(tiles.size()));
        if (!written.present) return;
        journal_.add(tiles[i], written.finished);
        there.push_back(tiles[i]);
        added.bytes += written.finished.bytes;
        added.kept += written.kept ? 1 : 0;
        summary.max_error = std::max(summary.max_error, written.finished.max_error);
      });
  summary.tiles = there.size();
  result.tiles += there.size();
  result.bytes += added.bytes;
  result.kept += added.kept;
  result.zooms.insert(result.zooms.begin(), summary);
  deeper_ = {there.begin(), there.end()};
  present[plan.zoom] = std::move(there);
}

void TileSetWriter::write_zoom(unsigned zoom) {
  TileSurface& surface = *surfaces_.front();
  const std::vector<TileAddress> tiles = candidates(zoom, surface);
  // A quarter more, for what is filled beside the samples.
  double range = 1.25 * widest_range(tiles, surface);
  for (;;) {
    try {
      write_tiles(plan_zoom(zoom, max_error_of(options_, zoom), range, surface), tiles);
      return;
    } catch (const HeightsTooFar&) {
      if (range > 1e7) {
        throw stream::Error({.file = options_.folder,
                             .where = "zoom " + std::to_string(zoom),
                             .cause = "heights beyond 10,000 km have no place on a globe",
                             .remedy = "look at the unit and the nodata value of the source"});
      }
      range = std::max(1.0, 2.0 * range);
    }
  }
}

/// Removes tiles of an earlier set that this one does not have, and folders that are empty then.
std::uint64_t remove_others(const std::string& folder,
                            const std::vector<std::vector<TileAddress>>& present) {
  std::vector<fs::path> gone;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const auto tile = parse_tile_path(fs::relative(entry.path(), folder).generic_string());
    if (!tile) continue;
    const auto by_row = [](const TileAddress& a, const TileAddress& b) {
      return a.y != b.y ? a.y < b.y : a.x < b.x;
    };
    if (tile->zoom >= present.size() ||
        !std::binary_search(present[tile->zoom].begin(), present[tile->zoom].end(), *tile,
                            by_row)) {
      gone.push_back(entry.path());
    }
  }
  for (const fs::path& path : gone) {
    fs::remove(path);
    // Fails on folders that are not empty, as it should.
    std::error_code ignored;
    if (fs::remove(path.parent_path(), ignored)) {
      fs::remove(path.parent_path().parent_path(), ignored);
    }
  }
  return gone.size();
}

std::string fingerprint_of(const TileSetOptions& options) {
  std::string text = "1 ";
  text += options.source_fingerprint;
  for (const double number : {static_cast<double>(options.first_zoom),
                              static_cast<double>(options.last_zoom), options.max_error}) {
    text.append(" ").append(number_text(number));
  }
  text.append(" ").append(std::to_string(static_cast<int>(options.mesh.quality)));
  for (const bool flag :
       {options.mesh.normals, options.mesh.water, options.gzip, options.metadata}) {
    text += flag ? " yes" : " no";
  }
  return text;
}

}  // namespace

double max_error_of(const TileSetOptions& options, unsigned zoom) {
  if (options.max_error == 0.0) return expected_error(zoom);
  return std::ldexp(options.max_error, static_cast<int>(options.last_zoom - zoom));
}

unsigned native_zoom(double spacing) {
  unsigned zoom = 0;
  while (zoom < kDeepestZoom && std::ldexp(180.0 / 64.0, -static_cast<int>(zoom)) > spacing) ++zoom;
  return zoom;
}

void check_tile_folder(const std::string& folder, bool force, bool resume) {
  const auto refuse = [&](const std::string& cause, const std::string& remedy) {
    throw stream::Error({.file = folder, .where = {}, .cause = cause, .remedy = remedy});
  };
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) refuse("is no folder", "name another one");
  if (fs::is_empty(folder)) return;
  const bool begun = fs::exists(folder + "/" + TileJournal::kName);
  const bool finished = fs::exists(folder + "/" + kLayerName);
  if (!begun && !finished) {
    refuse("is not empty and holds no tile set", "name another folder, or empty it yourself");
  }
  if (finished) {
    const TileLayer layer = read_layer(folder + "/" + kLayerName);
    if (layer.fingerprint.empty()) {
      refuse("holds a tile set that terrace did not write", "name another folder");
    }
    if (!force && !resume) {
      refuse("holds a tile set already", "give --force to make it anew, or name another folder");
    }
    return;
  }
  if (!force && !resume) {
    refuse("holds a tile set that was begun and not finished",
           "give --resume to go on, or --force to make it anew");
  }
}

TileSetResult write_tile_set(const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                             const TileSetOptions& options, const CommonOptions& common) {
  const std::string layer_path = options.folder + "/" + kLayerName;
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error) throw stream::system_error(options.folder, "cannot be made", error.value());
  const std::string fingerprint = fingerprint_of(options);
  TileSetWriter writer(surfaces, options, common, fingerprint);
  // From here on it is no set until it is whole.
  fs::remove(layer_path, error);
  if (error) throw stream::system_error(layer_path, "cannot be removed", error.value());

  writer.present.resize(options.last_zoom + 1);
  for (unsigned zoom = options.last_zoom + 1; zoom-- > options.first_zoom;) writer.write_zoom(zoom);
  writer.result.removed = remove_others(options.folder, writer.present);

  TileLayer layer;
  layer.name = options.name;
  layer.bounds = surfaces.front()->bounds();
  layer.first_zoom = options.first_zoom;
  layer.last_zoom = options.last_zoom;
  if (options.mesh.normals) layer.extensions.emplace_back("octvertexnormals");
  if (options.mesh.water) layer.extensions.emplace_back("watermask");
  if (options.metadata) layer.extensions.emplace_back("metadata");
  for (const auto& tiles : writer.present) layer.available.push_back(ranges_of(tiles));
  layer.max_errors.assign(options.last_zoom + 1, 0.0);
  for (const ZoomSummary& zoom : writer.result.zooms) {
    layer.max_errors[zoom.zoom] = std::max(zoom.max_error, max_error_of(options, zoom.zoom));
  }
  layer.fingerprint = fingerprint;
  sync_folder(options.folder);
  stream::AtomicFile file(layer_path, true);
  file.write(layer_json(layer));
  file.commit();
  fs::remove(options.folder + "/" + TileJournal::kName, error);
  writer.result.bytes += fs::file_size(layer_path);
  return std::move(writer.result);
}

}  // namespace terrace::tools
