// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/tile_check.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "interrupt.hpp"
#include "ordered_work.hpp"
#include "tile/tile_candidates.hpp"
#include "tile/tile_file.hpp"
#include "tile/tile_height_check.hpp"
#include "tile/tile_inventory.hpp"
#include "tile/tile_journal.hpp"
#include "tile/tile_layer.hpp"
#include "tile/tile_mesh_check.hpp"
#include "units.hpp"

namespace terrace::tools {
namespace {

/// What a tile may unpack to.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;
/// Metres by which neighbours' heights may differ, and by which rounding may exceed a bound:
/// samples are placed on the globe to a hundredth of a millimetre.
constexpr double kBorderSlack = 1e-3;
constexpr double kHeightSlack = 1e-4;

/// Vertices on a side: place along it, and metres.
using Side = std::vector<std::pair<std::uint16_t, double>>;

/// A tile that was looked at.
struct Checked {
  bool decoded = false;
  std::vector<TileFault> faults;
  Side west, south, east, north;
  TileHeights heights;
};

/// The number in "byte 17" of a message.
std::uint64_t byte_of(std::string_view where) {
  std::uint64_t byte = 0;
  if (where.starts_with("byte "))
    std::from_chars(where.data() + 5, where.data() + where.size(), byte);
  return byte;
}

/// Decodes a tile, compressed or not.
DecodedTile unpack_tile(const std::vector<std::byte>& bytes, const std::string& name) {
  if (!stream::is_gzip(bytes)) return decode_tile(bytes, name);
  try {
    return decode_tile(stream::gunzip(bytes, kMostBytes, name), name);
  } catch (const stream::Error& packed) {
    // One plain tile of 65536 begins as gzip does.
    try {
      return decode_tile(bytes, name);
    } catch (const stream::Error&) {
      throw packed;
    }
  }
}

void take_sides(const TileMesh& mesh, Checked& checked) {
  const TileEdges edges = edges_of(mesh);
  const auto take = [&](const std::vector<std::uint32_t>& list,
                        const std::vector<std::uint16_t>& along) {
    Side side;
    for (const std::uint32_t vertex : list) side.emplace_back(along[vertex], mesh.metres(vertex));
    return side;
  };
  checked.west = take(edges.west, mesh.v);
  checked.east = take(edges.east, mesh.v);
  checked.south = take(edges.south, mesh.u);
  checked.north = take(edges.north, mesh.u);
}

/// What is wrong between two sides; empty if they fit.
std::string misfit(const Side& a, const Side& b) {
  const bool same_places = a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                                              [](const auto& p, const auto& q) {
                                                                return p.first == q.first;
                                                              });
  if (!same_places) return "vertices at other places";
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i].second - b[i].second));
  }
  return most > kBorderSlack ? "heights that differ by up to " + number_text(most) + " m" : "";
}

class SetCheck {
 public:
  SetCheck(const TileCheckOptions& options, TileLayer layer, unsigned threads,
           const std::vector<std::unique_ptr<TileSurface>>& surfaces, const CommonOptions& common)
      : options_(options),
        layer_(std::move(layer)),
        threads_(threads),
        surfaces_(surfaces),
        common_(common) {}

  /// Of all zooms together, so that the few large tiles of the upper ones share the threads.
  void tiles(const std::vector<TileAddress>& tiles);
  /// tiles: of one zoom.
  void absent(unsigned zoom, const std::vector<TileAddress>& tiles);

  TileCheckResult result;

 private:
  [[nodiscard]] std::string path_of(const TileAddress& tile) const {
    return options_.folder + "/" + tile_path(tile);
  }
  [[nodiscard]] double bound_of(unsigned zoom) const;
  [[nodiscard]] Checked check(const TileAddress& tile, unsigned worker) const;
  void compare(const TileAddress& tile, const char* side, const Side& own,
               const TileAddress& neighbour, const Side& other);
  void add(unsigned zoom, const TileHeights& heights);

  const TileCheckOptions& options_;
  TileLayer layer_;
  unsigned threads_;
  const std::vector<std::unique_ptr<TileSurface>>& surfaces_;
  const CommonOptions& common_;
};

double SetCheck::bound_of(unsigned zoom) const {
  if (options_.max_error) {
    return std::ldexp(*options_.max_error, static_cast<int>(layer_.last_zoom - zoom));
  }
  return zoom < layer_.max_errors.size() ? layer_.max_errors[zoom] : expected_error(zoom);
}

Checked SetCheck::check(const TileAddress& tile, unsigned worker) const {
  check_interrupt();
  Checked checked;
  DecodedTile decoded;
  try {
    const std::string path = path_of(tile);
    decoded = unpack_tile(read_tile_file(path), path);
  } catch (const stream::Error& error) {
    checked.faults.push_back({byte_of(error.parts().where), error.parts().cause});
    return checked;
  }
  checked.decoded = true;
  checked.faults = check_tile_mesh(tile, decoded, layer_.extensions);
  take_sides(decoded.mesh, checked);
  if (surfaces_.empty()) return checked;
  checked.heights = measure_tile(tile, decoded.mesh, *surfaces_[worker]);
  const TileHeights& heights = checked.heights;
  if (heights.uncovered > 0) {
    checked.faults.push_back(
        {0, with_commas(heights.uncovered) + " samples of the store lie over no triangle"});
  }
  const double bound = bound_of(tile.zoom);
  if (heights.max_error > bound * (1.0 + 1e-9) + kHeightSlack) {
    checked.faults.push_back({0, "the sample at " + number_text(heights.longitude) + ", " +
                                     number_text(heights.latitude) + " is " +
                                     number_text(heights.max_error) +
                                     " m off the tile, more than " + number_text(bound) + " m"});
  }
  return checked;
}

void SetCheck::compare(const TileAddress& tile, const char* side, const Side& own,
                       const TileAddress& neighbour, const Side& other) {
  const std::string what = misfit(own, other);
  if (what.empty()) return;
  result.problems.push_back(
      {path_of(tile), 0,
       std::string("its ") + side + " side and that of " + tile_path(neighbour) + " have " + what});
}

void SetCheck::tiles(const std::vector<TileAddress>& tiles) {
  // Northern sides of the row below and of this row, by column, and the eastern side of the tile
  // before this one.
  std::map<std::uint32_t, Side> below, row;
  Side before;
  std::optional<TileAddress> last;
  ProgressMeter meter(common_.progress, "tiles");
  in_order(
      tiles.size(), threads_,
      [&](unsigned worker, std::size_t i) { return check(tiles[i], worker); },
      [&](std::size_t i, Checked&& checked) {
        const TileAddress& tile = tiles[i];
        for (TileFault& fault : checked.faults) {
          result.problems.push_back({path_of(tile), fault.offset, std::move(fault.what)});
        }
        if (!last || last->zoom != tile.zoom || last->y != tile.y) {
          const bool next = last && last->zoom == tile.zoom && last->y + 1 == tile.y;
          below = next ? std::move(row) : std::map<std::uint32_t, Side>{};
          row.clear();
          before.clear();
        }
        if (checked.decoded) {
          if (!before.empty() && last && last->x + 1 == tile.x) {
            compare(tile, "western", checked.west, *last, before);
          }
          if (const auto under = below.find(tile.x); under != below.end()) {
            compare(tile, "southern", checked.south, {tile.zoom, tile.x, tile.y - 1},
                    under->second);
          }
          row[tile.x] = std::move(checked.north);
        }
        before = std::move(checked.east);
        last = tile;
        add(tile.zoom, checked.heights);
        meter.update(i + 1, static_cast<double>(i + 1) / static_cast<double>(tiles.size()));
      });
}

void SetCheck::add(unsigned zoom, const TileHeights& heights) {
  ZoomCheck& sum = result.zooms[zoom];
  ++sum.tiles;
  sum.samples += heights.samples;
  sum.max_error = std::max(sum.max_error, heights.max_error);
  ++result.tiles;
  result.samples += heights.samples;
}

void SetCheck::absent(unsigned zoom, const std::vector<TileAddress>& tiles) {
  TileSurface& surface = *surfaces_.front();
  auto at = tiles.begin();
  for (const TileAddress& tile : tiles_with_samples(surface, zoom)) {
    while (at != tiles.end() && (at->y < tile.y || (at->y == tile.y && at->x < tile.x))) ++at;
    if (at != tiles.end() && *at == tile) continue;
    const std::uint64_t samples = count_samples(tile, surface);
    if (samples > 0) {
      result.problems.push_back(
          {path_of(tile), 0, "no tile where the store has " + with_commas(samples) + " samples"});
    }
  }
}

}  // namespace

bool is_tile_folder(const std::string& folder) {
  return std::filesystem::exists(folder + "/layer.json") ||
         std::filesystem::exists(folder + "/" + TileJournal::kName);
}

TileCheckResult check_tile_set(const TileCheckOptions& options, unsigned threads,
                               const std::vector<std::unique_ptr<TileSurface>>& surfaces,
                               const CommonOptions& common) {
  const std::string layer_path = options.folder + "/layer.json";
  if (!std::filesystem::exists(layer_path)) {
    throw stream::Error({.file = options.folder,
                         .where = {},
                         .cause = "holds a tile set that was begun and not finished",
                         .remedy = "finish it first: terrace tile with --resume"});
  }
  TileLayer layer = read_layer(layer_path);
  TileInventory inventory = take_inventory(options.folder, layer);
  const unsigned first = layer.first_zoom;
  SetCheck check(options, std::move(layer), threads, surfaces, common);
  check.result.problems = std::move(inventory.problems);
  std::vector<TileAddress> all;
  for (unsigned zoom = 0; zoom < inventory.tiles.size(); ++zoom) {
    check.result.zooms.push_back({.zoom = zoom});
    all.insert(all.end(), inventory.tiles[zoom].begin(), inventory.tiles[zoom].end());
  }
  check.tiles(all);
  if (!surfaces.empty()) {
    for (unsigned zoom = first; zoom < inventory.tiles.size(); ++zoom) {
      check.absent(zoom, inventory.tiles[zoom]);
    }
  }
  check.result.zooms.erase(check.result.zooms.begin(), check.result.zooms.begin() + first);
  return std::move(check.result);
}

}  // namespace terrace::tools
