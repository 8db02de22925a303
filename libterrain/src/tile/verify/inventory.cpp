// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "tile/set/file.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// The most missing tiles of a zoom that are reported one by one.
constexpr std::uint64_t kMaxNamed = 1000;

class Inventory {
 public:
  Inventory(const std::string& folder, const TileLayer& layer, const Context& context)
      : folder_(folder), layer_(layer), context_(context), layer_path_(folder + "/layer.json") {}

  void bounds();
  void files();
  void zoom(unsigned zoom);

  TileInventory result;

 private:
  void problem(const std::string& file, std::string what) {
    result.problems.push_back({file, 0, std::move(what)});
  }

  const std::string& folder_;
  const TileLayer& layer_;
  const Context& context_;
  std::string layer_path_;
};

void Inventory::bounds() {
  const GeographicBox& b = layer_.bounds;
  const bool good = b.west >= -180.0 && b.west <= b.east && b.east <= 180.0 && b.south >= -90.0 &&
                    b.south <= b.north && b.north <= 90.0;
  if (!good) problem(layer_path_, "bounds that are not a box on the globe");
  if (!layer_.max_errors.empty() && layer_.max_errors.size() != layer_.available.size()) {
    problem(layer_path_, fmt::format("errors of {} zooms, tiles of {}", layer_.max_errors.size(),
                                     layer_.available.size()));
  }
  for (const double error : layer_.max_errors) {
    if (!std::isfinite(error) || error < 0.0)
      problem(layer_path_, "an error that is not a distance");
  }
}

void Inventory::files() {
  result.tiles.resize(layer_.available.size());
  std::vector<std::string> strange;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder_, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    context_.check_stop();
    if (entry->is_directory()) continue;
    const std::string name = entry->path().lexically_relative(folder_).generic_string();
    if (const auto tile = parse_tile_path(name); tile && tile->zoom < result.tiles.size()) {
      result.tiles[tile->zoom].push_back(*tile);
    } else if (is_torn_tile(name)) {
      ++result.torn;
    } else if (name.ends_with(".terrain")) {
      strange.push_back(name);
    }
  }
  if (error) throw stream::system_error(folder_, "cannot be read", error.value());
  std::sort(strange.begin(), strange.end());
  for (const std::string& name : strange) {
    problem(folder_ + "/" + name, "its path does not name a tile of the set");
  }
  for (auto& tiles : result.tiles) std::sort(tiles.begin(), tiles.end(), by_row);
}

void Inventory::zoom(unsigned zoom) {
  const std::vector<TileAddress>& existing = result.tiles[zoom];
  const std::vector<TileRange>& ranges = layer_.available[zoom];
  const std::string label = fmt::format("zoom {}", zoom);
  if (zoom < layer_.first_zoom && !ranges.empty()) {
    problem(layer_path_, label + " has tiles, but is above minzoom");
  }
  if (zoom >= layer_.first_zoom && ranges.empty()) problem(layer_path_, label + " has no tiles");
  std::vector<unsigned> named(existing.size());
  std::uint64_t missing = 0;
  for (const TileRange& range : ranges) {
    const std::uint64_t width = std::uint64_t{range.x1} - range.x0 + 1;
    const std::uint64_t height = std::uint64_t{range.y1} - range.y0 + 1;
    // A range that claims a whole planet is not enumerated.
    if (width * height > 64 * (existing.size() + (std::uint64_t{1} << 20))) {
      problem(layer_path_, label + " claims " + counted(width * height, "tile") + ", but only " +
                               with_commas(existing.size()) +
                               (existing.size() == 1 ? " exists" : " exist"));
      continue;
    }
    for (std::uint32_t y = range.y0; y <= range.y1; ++y) {
      auto at = std::lower_bound(existing.begin(), existing.end(), TileAddress{zoom, range.x0, y},
                                 by_row);
      for (std::uint32_t x = range.x0; x <= range.x1; ++x) {
        const TileAddress tile{zoom, x, y};
        if (at != existing.end() && *at == tile) {
          ++named[static_cast<std::size_t>(at - existing.begin())];
          ++at;
        } else if (missing++ < kMaxNamed) {
          problem(folder_ + "/" + tile_path(tile),
                  "layer.json lists this tile, but it does not exist");
        }
      }
    }
  }
  if (missing > kMaxNamed) {
    problem(layer_path_,
            label + ": " +
                counted(missing - kMaxNamed, "more listed tile", "does not exist", "do not exist"));
  }
  for (std::size_t i = 0; i < existing.size(); ++i) {
    if (named[i] == 1) continue;
    problem(folder_ + "/" + tile_path(existing[i]),
            named[i] == 0 ? "a tile that layer.json does not list"
                          : "a tile that layer.json lists more than once");
  }
  if (zoom == 0 && layer_.first_zoom == 0) {
    for (std::uint32_t x = 0; x < 2; ++x) {
      const TileAddress root{0, x, 0};
      const bool claimed = std::any_of(ranges.begin(), ranges.end(), [x](const TileRange& range) {
        return range.x0 <= x && x <= range.x1;
      });
      if (!claimed) {
        problem(layer_path_, tile_path(root) + " is not listed: globes request both roots");
      }
    }
  }
}

}  // namespace

TileInventory take_inventory(const std::string& folder, const TileLayer& layer,
                             const Context& context) {
  Inventory inventory(folder, layer, context);
  inventory.bounds();
  inventory.files();
  for (unsigned zoom = 0; zoom < layer.available.size(); ++zoom) inventory.zoom(zoom);
  return std::move(inventory.result);
}

}  // namespace terrace::terrain
