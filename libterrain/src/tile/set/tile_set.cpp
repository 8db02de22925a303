// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/set/tile_set.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <utility>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"
#include "tile/set/tile_file.hpp"
#include "tile/set/tile_journal.hpp"
#include "tile/set/tile_set_writer.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLayerName = "layer.json";
constexpr const char* kLockName = ".terrace-tiles.lock";

std::string fingerprint_of(const TileSetOptions& options) {
  std::string text = "1 ";
  text += options.source_fingerprint + " ";
  text += std::to_string(checksum_of(std::as_bytes(std::span(options.source_options))));
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

/// A finished set is gone on with only to mend it.
void refuse_another(const std::string& layer_path, const std::string& fingerprint) {
  if (!fs::exists(layer_path) || read_layer(layer_path).fingerprint == fingerprint) return;
  throw stream::Error(
      {.file = layer_path,
       .where = {},
       .cause = "finished, and made of another store or with other options",
       .remedy = "give `replace` to replace it: tiles that stay the same are kept"});
}

/// Whether there is anything in `folder` without a tile set, begun or finished.
bool holds_others(const std::string& folder) {
  if (fs::exists(folder + "/" + TileJournal::kName) || fs::exists(folder + "/" + kLayerName)) {
    return false;
  }
  std::error_code none;  // such as no folder
  const fs::directory_iterator entries(folder, none);
  return std::any_of(fs::begin(entries), fs::end(entries),
                     [](const auto& entry) { return entry.path().filename() != kLockName; });
}

/// Not touched if it says the same.
void write_layer(const std::string& path, const std::string& text) {
  const std::vector<std::byte> before = read_tile_file(path);
  const auto bytes = std::as_bytes(std::span(text));
  if (std::equal(before.begin(), before.end(), bytes.begin(), bytes.end())) return;
  stream::AtomicFile file(path, true);
  file.write(text);
  file.commit();
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

TileFolder::TileFolder(const std::string& folder, bool force, bool resume)
    : path_(stream::follow_links(folder).string()) {
  const auto refuse = [&](const std::string& cause, const std::string& remedy) {
    throw stream::Error({.file = folder, .where = {}, .cause = cause, .remedy = remedy});
  };
  if (fs::exists(path_) && !fs::is_directory(path_)) refuse("is no folder", "name another one");
  // Nothing is made in a folder of somebody else, not even the lock.
  if (holds_others(path_)) {
    refuse("is not empty and holds no tile set", "name another folder, or empty it yourself");
  }
  std::error_code error;
  made_ = fs::create_directories(path_, error);
  if (error) throw stream::system_error(folder, "cannot be made", error.value());
  lock_ = stream::FileLock(fs::path(path_) / kLockName);
  if (!lock_.held()) {
    refuse("another run is writing tiles to it", "wait until it ends, or name another folder");
  }
  const std::string layer_path = path_ + "/" + kLayerName;
  const std::string journal_path = path_ + "/" + TileJournal::kName;
  if (fs::exists(layer_path)) {
    if (read_layer(layer_path).fingerprint.empty()) {
      refuse("holds a tile set that terrace did not write", "name another folder");
    }
    if (!force && !resume) {
      refuse("holds a tile set already",
             "give `replace` to replace it (what stays the same is kept), or name another folder");
    }
  } else if (fs::exists(journal_path) && !force && !resume) {
    refuse("holds a tile set that was begun and not finished",
           "give `resume` to go on, or `replace` to replace it");
  }
  stream::remove_abandoned(layer_path);
  stream::remove_abandoned(journal_path);
}

TileFolder::~TileFolder() {
  lock_.release();
  std::error_code ignored;
  if (made_) fs::remove(path_, ignored);  // fails if it is not empty, as it should
}

TileSetResult write_tile_set(const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                             const TileSetOptions& options, const Context& context) {
  if (options.metadata && options.first_zoom > 0) {
    throw UsageError("`metadata` says in each tile which lie below it, from zoom 0 on: `zoom` 0-" +
                     std::to_string(options.last_zoom) + ", or go without");
  }
  const std::string layer_path = options.folder + "/" + kLayerName;
  const std::string fingerprint = fingerprint_of(options);
  if (options.resume && !options.replace) refuse_another(layer_path, fingerprint);
  TileSetWriter writer(surfaces, options, context, layer_path);
  for (unsigned zoom = options.last_zoom + 1; zoom-- > options.first_zoom;) writer.write_zoom(zoom);
  writer.finish();

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
  write_layer(layer_path, layer_json(layer));
  writer.result.bytes += fs::file_size(layer_path);
  return std::move(writer.result);
}

}  // namespace terrace::terrain
