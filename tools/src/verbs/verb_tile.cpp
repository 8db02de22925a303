// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/choices.hpp"
#include "cli/interrupt.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "tile/make/tile_source.hpp"
#include "tile/set/tile_file.hpp"
#include "tile/set/tile_inputs.hpp"
#include "tile/set/tile_journal.hpp"
#include "tile/set/tile_set.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// What a thread needs: the samples of a leaf, their mesh and what is kept of the store.
constexpr std::uint64_t kTileBytesPerThread = std::uint64_t{96} << 20;
/// Fill and blocks of the store, and the lists of tiles.
constexpr std::uint64_t kTileBytesBeside = std::uint64_t{80} << 20;

std::pair<unsigned, unsigned> parse_zooms(const std::string& text, unsigned native) {
  if (text.empty()) return {0, native};
  const auto number = [&](std::string_view part) {
    unsigned value = 0;
    const auto result = std::from_chars(part.data(), part.data() + part.size(), value);
    if (result.ec != std::errc{} || result.ptr != part.data() + part.size() ||
        value > kDeepestZoom) {
      throw UsageError("--zoom '" + text + "': FIRST-LAST, from 0 to " +
                       std::to_string(kDeepestZoom));
    }
    return value;
  };
  const std::size_t dash = text.find('-');
  if (dash == std::string::npos) return {0, number(text)};
  const std::pair zooms{number(std::string_view(text).substr(0, dash)),
                        number(std::string_view(text).substr(dash + 1))};
  if (zooms.first > zooms.second) throw UsageError("--zoom '" + text + "': the smaller one first");
  return zooms;
}

class TileCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the samples come from: a raster, or irregular points")
        ->required();
    add_output(app, output_, "the folder to write");
    app.add_option("--format", format_, "quantized-mesh")->capture_default_str();
    app.add_option("--zoom", zoom_, "FIRST-LAST; else from 0 to where tiles show every sample");
    add_number(app, "--max-error", max_error_,
               "metres within which the deepest zoom is of every sample, twice as much at each "
               "zoom above; else what globes expect: 77067 / 2^zoom",
               kAboveZero)
        ->type_name("METRES");
    app.add_option("--quality", quality_, "greedy, removal (fewer triangles) or fitted")
        ->capture_default_str();
    app.add_option("--fill", fill_,
                   "heights where there is no data, or beyond the hull of irregular points: "
                   "interpolate, flat (the store's lowest) or flat:METRES")
        ->capture_default_str();
    app.add_flag("--gzip", gzip_,
                 "compressed tiles: the server must send Content-Encoding: gzip with them");
    app.add_flag("--normals", normals_, "with normals at the vertices, for lighting");
    app.add_option("--water", water_,
                   "with a mask of what is water: nodata (what a raster has no data for), or a "
                   "height of the store")
        ->type_name("nodata|HEIGHT");
    app.add_flag("--metadata", metadata_, "with the list of the tiles below in each tile");
    app.add_option("--vertical", vertical_,
                   "ellipsoidal: heights are above the ellipsoid; ignore: take them as if; "
                   "orthometric: above the sea, and go to the ellipsoid from the store's vertical "
                   "CRS, or from EGM96 if it has none");
    app.add_option("--geoid", geoid_, "a geoid grid of GeographicLib, added to the heights")
        ->type_name("FILE");
    app.add_flag(
        "--resume", resume_,
        "go on with a run that was interrupted, or mend a finished set: what is whole is kept");
    app.add_option("--name", name_, "of the tile set, in layer.json");
  }

  Summary run(const CommonOptions& common) override;

 private:
  [[nodiscard]] TileSetOptions options_for(const stream::Store& store, double spacing,
                                           const CommonOptions& common) const;

  std::string store_, output_, format_ = "quantized-mesh", zoom_, quality_ = "removal";
  std::string fill_ = "interpolate", water_, vertical_, geoid_, name_;
  std::optional<double> max_error_;
  bool gzip_ = false, normals_ = false, metadata_ = false, resume_ = false;
};

/// Identifies the store: a change invalidates every tile.
std::string store_fingerprint(const stream::Store& store) {
  const std::vector<std::byte> manifest = read_tile_file((store.path() / "manifest.json").string());
  return std::to_string(checksum_of(manifest));
}

TileSetOptions TileCommand::options_for(const stream::Store& store, double spacing,
                                        const CommonOptions& common) const {
  TileSetOptions options;
  options.name = name_.empty() ? store.path().stem().string() : name_;
  const unsigned native = native_zoom(spacing);
  std::tie(options.first_zoom, options.last_zoom) = parse_zooms(zoom_, native);
  if (options.last_zoom > native) {
    common.say("zoom " + std::to_string(native) + " shows every sample: deeper ones, to " +
               std::to_string(options.last_zoom) + ", show no more");
  }
  options.max_error = max_error_.value_or(0.0);
  options.mesh.quality = parse_quality(quality_);
  options.mesh.normals = normals_;
  options.mesh.water = !water_.empty();
  options.gzip = gzip_;
  options.metadata = metadata_;
  options.resume = resume_;
  options.replace = common.force;
  options.source_fingerprint = store_fingerprint(store);
  options.source_options = fill_ + "\n" + water_ + "\n" + vertical_;
  if (!geoid_.empty()) options.source_options += "\n" + std::to_string(digest_of_file(geoid_));
  return options;
}

Summary TileCommand::run(const CommonOptions& common) {
  const Stopwatch watch;
  if (format_ != "quantized-mesh") {
    throw UsageError("--format '" + format_ + "': quantized-mesh is the one that works");
  }
  const stream::Store store = open_store(store_);
  const Context context = common.context();
  const std::uint64_t memory = context.memory_or(0);
  if (memory < kTileBytesBeside + kTileBytesPerThread) {
    throw stream::Error(
        {.file = store_,
         .where = {},
         .cause = "tiles need " + std::to_string((kTileBytesBeside + kTileBytesPerThread) >> 20) +
                  "M of memory, --memory allows " + std::to_string(memory >> 20) + "M",
         .remedy = "allow more"});
  }
  const TileFolder folder(output_, common.force, resume_);
  const unsigned threads = static_cast<unsigned>(
      std::min<std::uint64_t>(common.threads, (memory - kTileBytesBeside) / kTileBytesPerThread));

  const std::unique_ptr<TileSource> source = open_tile_source(store,
                                                              {.vertical = vertical_,
                                                               .geoid = geoid_,
                                                               .fill = fill_,
                                                               .water = water_,
                                                               .memory_bytes = memory,
                                                               .threads = threads},
                                                              context);
  const std::vector<std::unique_ptr<TileSurface>>& surfaces = source->surfaces();
  TileSetOptions options = options_for(store, surfaces.front()->spacing(), common);
  options.folder = folder.path();
  const TileSetResult result = write_tile_set(surfaces, options, context);

  Summary summary;
  nlohmann::ordered_json zooms = nlohmann::ordered_json::array();
  for (const ZoomSummary& zoom : result.zooms) {
    zooms.push_back({{"zoom", zoom.zoom}, {"tiles", zoom.tiles}, {"max_error", zoom.max_error}});
    summary.text += "zoom " + std::to_string(zoom.zoom) + ": " + with_commas(zoom.tiles) +
                    " tiles, within " + readable_bound(zoom.max_error) + " m\n";
    if (zoom.max_error > max_error_of(options, zoom.zoom)) {
      common.say("zoom " + std::to_string(zoom.zoom) + ": " +
                 readable_number(max_error_of(options, zoom.zoom)) +
                 " m was asked for, less than what the 15 bits of a tile's coordinates show here");
    }
  }
  summary.json = {{"tiles", result.tiles},      {"bytes", result.bytes},
                  {"made", result.made},        {"kept", result.kept},
                  {"removed", result.removed},  {"zooms", zooms},
                  {"seconds", watch.seconds()}, {"peak_rss_bytes", peak_rss_bytes()}};
  summary.text += output_ + ": " + with_commas(result.tiles) + " tiles, " +
                  readable_bytes(result.bytes) + ", in " + readable_seconds(watch.seconds());
  if (result.made < result.tiles) {
    summary.text += "; " + with_commas(result.tiles - result.made) + " were there already";
  }
  summary.text += "\n";
  return summary;
}

}  // namespace

std::unique_ptr<Command> make_tile() { return std::make_unique<TileCommand>(); }

}  // namespace terrace::tools
