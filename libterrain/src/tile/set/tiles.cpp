// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/tiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/file_lock.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "terrace/terrain/error.hpp"
#include "tile/format/layer.hpp"
#include "tile/make/source.hpp"
#include "tile/set/file.hpp"
#include "tile/set/inputs.hpp"
#include "tile/set/journal.hpp"
#include "tile/set/writer.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLayerName = "layer.json";
constexpr const char* kLockName = ".terrace-tiles.lock";

/// Returns the options, apart from the store, that the surface depends on.
std::string source_options_of(const TilesRequest& request) {
  std::string text = request.fill == Fill::interpolate ? "interpolate" : "flat";
  if (request.flat_height) text += ":" + number_text(*request.flat_height);
  text += "\n";
  if (request.water) {
    text += request.water_height ? number_text(*request.water_height) : std::string("nodata");
  }
  constexpr std::array<const char*, 4> kReferences{"", "ellipsoidal", "orthometric", "ignore"};
  text += std::string("\n") + kReferences.at(static_cast<std::size_t>(request.vertical));
  if (!request.geoid.empty()) text += fmt::format("\n{}", digest_of_file(request.geoid));
  return text;
}

/// Identifies the store and the options; a change invalidates a finished set.
std::string fingerprint_of(const stream::Store& store, const TileSetOptions& options) {
  const TilesRequest& request = options.request;
  std::string text =
      fmt::format("1 {} {}", checksum_of(read_tile_file((store.path() / "manifest.json").string())),
                  checksum_of(std::as_bytes(std::span(options.source_options))));
  for (const double number :
       {static_cast<double>(request.first_zoom), static_cast<double>(options.last_zoom),
        request.max_error.value_or(0.0)}) {
    text.append(" ").append(number_text(number));
  }
  text += fmt::format(" {}", static_cast<int>(request.quality));
  for (const bool flag : {request.normals, request.water, request.gzip, request.metadata}) {
    text += flag ? " yes" : " no";
  }
  return text;
}

/// Throws: stream::Error if the folder has a finished set with other inputs or options.
void refuse_another(const std::string& layer_path, const std::string& fingerprint) {
  if (!fs::exists(layer_path) || read_layer(layer_path).fingerprint == fingerprint) return;
  throw stream::Error(layer_path, "is finished, and made from another store or with other options")
      .remedy(stream::message("pass {replace} to replace it: unchanged tiles are kept"));
}

/// Whether `folder` contains files but no tile set, finished or not.
bool holds_others(const std::string& folder) {
  if (fs::exists(folder + "/" + TileJournal::kName) || fs::exists(folder + "/" + kLayerName)) {
    return false;
  }
  std::error_code error;
  const fs::directory_iterator entries(folder, error);
  if (error && error != std::errc::no_such_file_or_directory) {
    throw stream::system_error(folder, "cannot be listed", error.value());
  }
  return std::any_of(fs::begin(entries), fs::end(entries),
                     [](const auto& entry) { return entry.path().filename() != kLockName; });
}

/// Also false for a file that cannot be read.
bool is_our_layer(const std::string& path) {
  try {
    return !read_layer(path).fingerprint.empty();
  } catch (const stream::Error&) {
    return false;
  }
}

/// Writes the file, unless it is identical.
void write_layer(const std::string& path, const std::string& text) {
  const std::vector<std::byte> before = read_tile_file(path);
  const auto bytes = std::as_bytes(std::span(text));
  if (std::equal(before.begin(), before.end(), bytes.begin(), bytes.end())) return;
  // Another program may have put its own file there since the run began.
  stream::AtomicFile file(path,
                          {[](const fs::path& there) { return is_our_layer(there.string()); }});
  file.write(text);
  file.commit();
}

/// The folder of a tile set during a run that writes to it: created if necessary, and locked
/// against other runs.
class TileFolder {
 public:
  /// Locks `folder` for writing. It must be missing or empty, or contain a tile set of terrace: any
  /// set if `force` is set, or an unfinished one if `resume` is set. Throws: stream::Error with the
  /// remedy otherwise, and if another run writes to it.
  TileFolder(const std::string& folder, bool force, bool resume);
  /// Removes a folder that was created here and stayed empty.
  ~TileFolder();
  TileFolder(const TileFolder&) = delete;
  TileFolder& operator=(const TileFolder&) = delete;

  /// The path with links resolved.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Throws: stream::Error if the folder was moved away during the run and its name now belongs to
  /// another one.
  void check_same() const;

 private:
  std::string path_;
  bool created_ = false;
  stream::FileLock lock_;
};

TileFolder::TileFolder(const std::string& folder, bool force, bool resume)
    : path_(stream::follow_links(folder).string()) {
  const auto fault = [&](std::string cause) { return stream::Error(folder, std::move(cause)); };
  if (fs::exists(path_) && !fs::is_directory(path_)) {
    throw fault("is not a folder").remedy("pass a folder");
  }
  // Create nothing in a folder of another program, not even the lock.
  if (holds_others(path_)) {
    throw fault("is not empty and contains no tile set")
        .remedy("pass another folder, or empty this one");
  }
  std::error_code error;
  created_ = fs::create_directories(path_, error);
  if (error) throw stream::system_error(folder, "cannot be created", error.value());
  lock_ = stream::FileLock(fs::path(path_) / kLockName);
  if (!lock_.held()) {
    throw fault("another run is writing tiles to it")
        .remedy("wait until it ends, or name another folder");
  }
  const std::string layer_path = path_ + "/" + kLayerName;
  const std::string journal_path = path_ + "/" + TileJournal::kName;
  if (fs::exists(layer_path)) {
    if (read_layer(layer_path).fingerprint.empty()) {
      throw fault("contains a tile set that terrace did not write").remedy("pass another folder");
    }
    if (!force && !resume) {
      throw fault("already contains a tile set")
          .remedy(stream::message(
              "give {replace} to replace it (unchanged tiles are kept), or name another folder"));
    }
  } else if (fs::exists(journal_path) && !force && !resume) {
    throw fault("contains an unfinished tile set")
        .remedy(stream::message("pass {resume} to continue, or {replace} to replace it"));
  }
  stream::remove_abandoned(layer_path);
  stream::remove_abandoned(journal_path);
}

void TileFolder::check_same() const {
  if (lock_.has_name()) return;
  throw stream::Error(path_, "has been moved or replaced by another program in the meantime")
      .remedy("run again, and do not move the folder");
}

TileFolder::~TileFolder() {
  lock_.release();
  std::error_code ignored;
  if (created_) fs::remove(path_, ignored);  // fails if it is not empty, as intended
}

/// Returns the zoom at which a 64th of a tile is at most as wide as the spacing of samples.
unsigned native_zoom(double spacing) {
  unsigned zoom = 0;
  while (zoom < kDeepestZoom && std::ldexp(180.0 / 64.0, -static_cast<int>(zoom)) > spacing) ++zoom;
  return zoom;
}

/// Throws: UsageError for options that do not work together.
void check_request(const TilesRequest& request) {
  for (const unsigned zoom : {request.first_zoom, request.last_zoom.value_or(0)}) {
    if (zoom > kDeepestZoom) {
      throw UsageError(stream::message("{zoom} {}: must be from 0 to {}", zoom, kDeepestZoom));
    }
  }
  if (request.max_error && !(*request.max_error > 0.0 && std::isfinite(*request.max_error))) {
    throw UsageError(stream::message("{max_error} must be a positive number of metres"));
  }
  if (request.metadata && request.first_zoom > 0) {
    throw UsageError(stream::message(
        "{metadata} lists in each tile the tiles below it, from zoom 0 on: begin with {zoom} 0, or "
        "leave it out"));
  }
}

}  // namespace

double TileSetOptions::max_error(unsigned zoom) const {
  if (!request.max_error) return expected_error(zoom);
  return std::ldexp(*request.max_error, static_cast<int>(last_zoom - zoom));
}

TilesOutcome write_tiles(const stream::Store& store, const TilesRequest& request,
                         const Context& context) {
  need_terrain(store, "a tile");
  check_request(request);
  const TileResources resources = tile_resources(context, store.path().string());
  const TileFolder folder(request.folder, request.replace, request.resume);
  const auto source = open_tile_source(store, request, resources, context);
  const std::vector<std::unique_ptr<TileSurface>>& surfaces = source->surfaces();
  const unsigned native = native_zoom(surfaces.front()->spacing());
  const TileSetOptions options{.request = request,
                               .folder = folder.path(),
                               .last_zoom = request.last_zoom.value_or(native),
                               .source_options = source_options_of(request)};
  if (request.first_zoom > options.last_zoom) {
    throw UsageError(stream::message("{zoom} {}-{}: give the smaller one first", request.first_zoom,
                                     options.last_zoom));
  }
  if (options.last_zoom > native) {
    context.say(fmt::format("zoom {} already shows every sample: deeper ones, to {}, add no detail",
                            native, options.last_zoom));
  }
  const std::string layer_path = options.folder + "/" + kLayerName;
  const std::string fingerprint = fingerprint_of(store, options);
  if (request.resume && !request.replace) refuse_another(layer_path, fingerprint);
  TileSetWriter writer(surfaces, options, context, layer_path);
  writer.check_strangers();
  writer.write_zooms();
  folder.check_same();
  writer.finish();

  TileLayer layer;
  layer.name = request.name.empty() ? store.path().stem().string() : request.name;
  layer.bounds = surfaces.front()->bounds();
  layer.first_zoom = request.first_zoom;
  layer.last_zoom = options.last_zoom;
  if (request.normals) layer.extensions.emplace_back("octvertexnormals");
  if (request.water) layer.extensions.emplace_back("watermask");
  if (request.metadata) layer.extensions.emplace_back("metadata");
  for (const auto& tiles : writer.present) layer.available.push_back(ranges_of(tiles));
  layer.max_errors.assign(options.last_zoom + 1, 0.0);
  for (const TileZoom& zoom : writer.result.zooms) {
    const double bound = options.max_error(zoom.zoom);
    if (zoom.max_error > bound) {
      context.say(
          fmt::format("zoom {}: {} m was requested, which is finer than the 15 bits of a tile's "
                      "coordinates here",
                      zoom.zoom, readable_number(bound)));
    }
    layer.max_errors[zoom.zoom] = std::max(zoom.max_error, bound);
  }
  layer.fingerprint = fingerprint;
  write_layer(layer_path, layer_json(layer));
  writer.result.bytes += fs::file_size(layer_path);
  return std::move(writer.result);
}

}  // namespace terrace::terrain
