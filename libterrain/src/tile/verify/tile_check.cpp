// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/tile_check.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string_view>
#include <utility>

#include <terrace/base/ordered_work.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "base/parallel.hpp"
#include "base/progress_report.hpp"
#include "base/units.hpp"
#include "tile/format/layer.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/sample_parts.hpp"
#include "tile/make/source.hpp"
#include "tile/set/file.hpp"
#include "tile/set/journal.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain {
namespace {

/// Tolerance of a bound for rounding, in metres. Samples are placed on the globe to a hundredth of
/// a millimetre.
constexpr double kHeightSlack = 1e-4;

/// Limit on the size of an uncompressed tile.
constexpr std::uint64_t kMaxBorderBytes = std::uint64_t{1} << 28;
/// Tolerance in metres for the heights of neighbours, in addition to the rounding of each.
constexpr double kBorderSlack = 1e-3;

/// A side of a tile.
struct BorderSide {
  /// The position along it in units of the tile, and metres.
  std::vector<std::pair<std::uint16_t, double>> vertices;
  double rounding = 0.0;  ///< rounding of a height, in metres
};

struct TileBorders {
  BorderSide west, south, east, north;
};

TileBorders borders_of(const TileMesh& mesh) {
  const TileEdges edges = edges_of(mesh);
  const double range = static_cast<double>(mesh.highest) - static_cast<double>(mesh.lowest);
  const auto take = [&](const std::vector<std::uint32_t>& list,
                        const std::vector<std::uint16_t>& along) {
    BorderSide side{.vertices = {}, .rounding = 0.5 * range / kTileUnits};
    for (const std::uint32_t vertex : list) {
      side.vertices.emplace_back(along[vertex], mesh.metres(vertex));
    }
    return side;
  };
  return {take(edges.west, mesh.v), take(edges.south, mesh.u), take(edges.east, mesh.v),
          take(edges.north, mesh.u)};
}

/// Describes how the sides of two neighbours differ; empty if they match.
std::string misfit(const BorderSide& one, const BorderSide& other) {
  const auto &a = one.vertices, &b = other.vertices;
  const bool same_places = a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                                              [](const auto& p, const auto& q) {
                                                                return p.first == q.first;
                                                              });
  if (!same_places) return "vertices at other places";
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(a[i].second - b[i].second));
  }
  return largest > kBorderSlack + one.rounding + other.rounding
             ? "heights that differ by up to " + readable_number(largest) + " m"
             : "";
}

/// Decodes the bytes of a tile's file, compressed or not. Throws: stream::Error, with `name`.
DecodedTile unpack_tile(const std::vector<std::byte>& bytes, const std::string& name) {
  if (!stream::is_gzip(bytes)) return decode_tile(bytes, name);
  try {
    return decode_tile(stream::gunzip(bytes, kMaxBorderBytes, name), name);
  } catch (const stream::Error& packed) {
    // One in 65536 uncompressed tiles begins like gzip.
    try {
      return decode_tile(bytes, name);
    } catch (const stream::Error&) {
      throw packed;
    }
  }
}

/// The result of checking a tile.
struct Checked {
  bool decoded = false;
  std::vector<TileFault> faults;
  TileBorders borders;
};

/// Parses the number in "byte 17" of a message.
std::uint64_t byte_of(std::string_view where) {
  std::uint64_t byte = 0;
  if (where.starts_with("byte "))
    std::from_chars(where.data() + 5, where.data() + where.size(), byte);
  return byte;
}

class SetCheck {
 public:
  SetCheck(const TileCheckRequest& request, TileLayer layer, unsigned threads,
           const std::vector<std::unique_ptr<TileSurface>>& surfaces, const Context& context)
      : request_(request),
        layer_(std::move(layer)),
        threads_(threads),
        surfaces_(surfaces),
        context_(context),
        records_(read_tile_records(request.folder)) {}

  /// tiles: of all zooms, sorted by zoom, row and column.
  void tiles(const std::vector<TileAddress>& tiles);
  /// tiles: of one zoom.
  void absent(unsigned zoom, const std::vector<TileAddress>& tiles);

  TileCheckResult result;

 private:
  [[nodiscard]] std::string path_of(const TileAddress& tile) const {
    return request_.folder + "/" + tile_path(tile);
  }
  [[nodiscard]] double bound_of(unsigned zoom) const;
  [[nodiscard]] bool is_as_written(const TileAddress& tile, std::span<const std::byte> bytes) const;
  [[nodiscard]] Checked check(const TileAddress& tile, const TileHeights& heights) const;
  /// A part of the globe that a thread measures in all tiles over it, so that most of the data
  /// decoded for one serves the others.
  struct Region {
    TileAddress tile;
    std::vector<std::size_t> tiles;  ///< the indices of this tile and of those below it
  };
  /// Measures the heights of each tile. Skips unreadable tiles, which check() reports.
  [[nodiscard]] std::vector<TileHeights> measure(const std::vector<TileAddress>& tiles) const;
  [[nodiscard]] std::vector<Region> regions_of(const std::vector<TileAddress>& tiles) const;
  void compare(const TileAddress& tile, const char* side, const BorderSide& side_vertices,
               const TileAddress& neighbour, const BorderSide& other);
  void add(unsigned zoom, const TileHeights& heights);

  const TileCheckRequest& request_;
  TileLayer layer_;
  unsigned threads_;
  const std::vector<std::unique_ptr<TileSurface>>& surfaces_;
  const Context& context_;
  std::vector<TileJournal::Record>
      records_;  ///< records of the written tiles, if there is a journal
};

double SetCheck::bound_of(unsigned zoom) const {
  if (request_.max_error) {
    return std::ldexp(*request_.max_error, static_cast<int>(layer_.last_zoom - zoom));
  }
  return zoom < layer_.max_errors.size() ? layer_.max_errors[zoom] : expected_error(zoom);
}

bool SetCheck::is_as_written(const TileAddress& tile, std::span<const std::byte> bytes) const {
  const auto record = std::lower_bound(
      records_.begin(), records_.end(), tile,
      [](const TileJournal::Record& a, const TileAddress& b) { return a.first < b; });
  if (record == records_.end() || record->first != tile) return true;
  return record->second.bytes == bytes.size() && record->second.checksum == checksum_of(bytes);
}

Checked SetCheck::check(const TileAddress& tile, const TileHeights& heights) const {
  context_.check_stop();
  Checked checked;
  DecodedTile decoded;
  try {
    const std::vector<std::byte> bytes = read_tile_file(path_of(tile));
    if (!is_as_written(tile, bytes)) {
      checked.faults.push_back(
          {0, "the file was changed after it was written: its checksum differs"});
    }
    decoded = unpack_tile(bytes, path_of(tile));
  } catch (const stream::Error& error) {
    checked.faults.push_back({byte_of(error.parts().where), error.parts().cause.text()});
    return checked;
  }
  checked.decoded = true;
  for (TileFault& fault : check_tile_mesh(tile, decoded, layer_.extensions)) {
    checked.faults.push_back(std::move(fault));
  }
  checked.borders = borders_of(decoded.mesh);
  if (heights.uncovered > 0) {
    checked.faults.push_back(
        {0, counted(heights.uncovered, "sample", "of the store is", "of the store are") +
                " over no triangle"});
  }
  const double bound = bound_of(tile.zoom);
  if (heights.max_error > bound * (1.0 + 1e-9) + kHeightSlack) {
    checked.faults.push_back({0, "the sample at " + readable_number(heights.longitude, 10) + ", " +
                                     readable_number(heights.latitude, 10) + " is " +
                                     readable_number(heights.max_error) +
                                     " m off the tile, more than " + readable_number(bound) +
                                     " m"});
  }
  return checked;
}

std::vector<SetCheck::Region> SetCheck::regions_of(const std::vector<TileAddress>& tiles) const {
  constexpr std::size_t kRegionsPerThread = 8;
  const unsigned deepest = tiles.empty() ? 0 : tiles.back().zoom;
  std::vector<TileAddress> found{{0, 0, 0}, {0, 1, 0}};
  for (;;) {
    // Uses boxes with their borders: samples there may be in no other region.
    std::erase_if(found, [&](const TileAddress& tile) {
      return !may_have_samples(box_of(tile), *surfaces_.front());
    });
    const bool enough = found.size() >= kRegionsPerThread * threads_;
    if (enough || found.empty() || found.front().zoom == deepest) break;
    std::vector<TileAddress> below;
    for (const TileAddress& tile : found) {
      for (const TileAddress& child : children_of(tile)) below.push_back(child);
    }
    found = std::move(below);
  }
  std::sort(found.begin(), found.end(), by_row);
  std::vector<Region> regions;
  for (const TileAddress& tile : found) regions.push_back({tile, {}});
  for (std::size_t i = 0; i < tiles.size() && !found.empty(); ++i) {
    if (tiles[i].zoom < found.front().zoom) continue;
    const TileAddress tile = ancestor_of(tiles[i], found.front().zoom);
    const auto at = std::lower_bound(found.begin(), found.end(), tile, by_row);
    if (at == found.end() || *at != tile) continue;  // it has no samples
    regions[static_cast<std::size_t>(at - found.begin())].tiles.push_back(i);
  }
  return regions;
}

std::vector<TileHeights> SetCheck::measure(const std::vector<TileAddress>& tiles) const {
  std::vector<TileHeights> heights(tiles.size());
  const std::vector<Region> regions = regions_of(tiles);
  std::mutex mutex;
  std::size_t finished = 0;
  ProgressReport report(context_, "regions");
  parallel_for(regions.size(), threads_, [&](std::size_t i, unsigned worker) {
    const Region& region = regions[i];
    const auto measure_part = [&](std::size_t number, const TileAddress& part) {
      context_.check_stop();
      const TileAddress& tile = tiles[number];
      DecodedTile decoded;
      try {
        decoded = unpack_tile(read_tile_file(path_of(tile)), path_of(tile));
      } catch (const stream::Error&) {
        return;
      }
      const TileHeights measured = measure_tile(tile, decoded.mesh, *surfaces_[worker], part);
      const std::lock_guard lock(mutex);
      heights[number].add(measured);
    };
    for (const std::size_t number : region.tiles) measure_part(number, tiles[number]);
    for (unsigned zoom = region.tile.zoom; zoom-- > 0;) {
      const TileAddress above = ancestor_of(region.tile, zoom);
      const auto at = std::lower_bound(tiles.begin(), tiles.end(), above,
                                       [](const TileAddress& a, const TileAddress& b) {
                                         return a.zoom != b.zoom ? a.zoom < b.zoom : by_row(a, b);
                                       });
      if (at != tiles.end() && *at == above) {
        measure_part(static_cast<std::size_t>(at - tiles.begin()), region.tile);
      }
    }
    const std::lock_guard lock(mutex);
    ++finished;
    report.update(finished, static_cast<double>(finished) / static_cast<double>(regions.size()));
  });
  return heights;
}

void SetCheck::compare(const TileAddress& tile, const char* side, const BorderSide& side_vertices,
                       const TileAddress& neighbour, const BorderSide& other) {
  const std::string what = misfit(side_vertices, other);
  if (what.empty()) return;
  result.problems.push_back(
      {path_of(tile), 0,
       std::string("its ") + side + " side and that of " + tile_path(neighbour) + " have " + what});
}

void SetCheck::tiles(const std::vector<TileAddress>& tiles) {
  // The northern sides of the row below and of this row, by column, the eastern side of the
  // previous tile, and the western side of the row's first tile. The first tile is next to the last
  // one.
  std::map<std::uint32_t, BorderSide> below, row;
  BorderSide before, first;
  std::optional<TileAddress> last;
  std::vector<TileHeights> heights(tiles.size());
  if (!surfaces_.empty()) heights = measure(tiles);
  ProgressReport report(context_, "tiles");
  base::in_order(
      tiles.size(), threads_, [&](unsigned, std::size_t i) { return check(tiles[i], heights[i]); },
      [&](std::size_t i, Checked&& checked) {
        const TileAddress& tile = tiles[i];
        for (TileFault& fault : checked.faults) {
          result.problems.push_back({path_of(tile), fault.offset, std::move(fault.what)});
        }
        if (!last || last->zoom != tile.zoom || last->y != tile.y) {
          const bool next = last && last->zoom == tile.zoom && last->y + 1 == tile.y;
          below = next ? std::move(row) : std::map<std::uint32_t, BorderSide>{};
          row.clear();
          before = {};
          first = {};
        }
        if (checked.decoded) {
          if (!before.vertices.empty() && last && last->x + 1 == tile.x) {
            compare(tile, "western", checked.borders.west, *last, before);
          }
          if (const auto under = below.find(tile.x); under != below.end()) {
            compare(tile, "southern", checked.borders.south, {tile.zoom, tile.x, tile.y - 1},
                    under->second);
          }
          if (!first.vertices.empty() && tile.x + 1 == tile_columns(tile.zoom)) {
            compare(tile, "eastern", checked.borders.east, {tile.zoom, 0, tile.y}, first);
          }
          if (tile.x == 0) first = std::move(checked.borders.west);
          row[tile.x] = std::move(checked.borders.north);
        }
        before = std::move(checked.borders.east);
        last = tile;
        add(tile.zoom, heights[i]);
        report.update(i + 1, static_cast<double>(i + 1) / static_cast<double>(tiles.size()));
      });
}

void SetCheck::add(unsigned zoom, const TileHeights& heights) {
  ZoomCheck& sum = result.zooms[zoom];
  ++sum.tiles;
  sum.samples += heights.samples;
  sum.uncovered += heights.uncovered;
  sum.max_error = std::max(sum.max_error, heights.max_error);
  ++result.tiles;
  result.samples += heights.samples;
}

void SetCheck::absent(unsigned zoom, const std::vector<TileAddress>& tiles) {
  TileSurface& surface = *surfaces_.front();
  auto at = tiles.begin();
  for (const TileAddress& tile : tiles_with_samples(surface, zoom, context_)) {
    while (at != tiles.end() && (at->y < tile.y || (at->y == tile.y && at->x < tile.x))) ++at;
    if (at != tiles.end() && *at == tile) continue;
    const std::uint64_t samples = count_samples(tile, surface);
    if (samples > 0) {
      result.problems.push_back(
          {path_of(tile), 0, "no tile where the store has " + counted(samples, "sample")});
    }
  }
}

}  // namespace

bool is_tile_folder(const std::string& folder) {
  return std::filesystem::exists(folder + "/layer.json") ||
         std::filesystem::exists(folder + "/" + TileJournal::kName);
}

TileCheckResult check_tiles(const TileCheckRequest& request, const Context& context) {
  if (!is_tile_folder(request.folder)) {
    throw stream::Error(request.folder, "contains no tile set")
        .remedy("pass the folder that it was written to");
  }
  const TileResources resources = tile_resources(context, request.folder);
  std::unique_ptr<TileSource> source;
  if (request.store != nullptr) {
    source = open_tile_source(*request.store,
                              {.folder = {}, .vertical = request.vertical, .geoid = request.geoid},
                              resources, context);
  }
  const std::string layer_path = request.folder + "/layer.json";
  if (!std::filesystem::exists(layer_path)) {
    throw stream::Error(request.folder, "contains an unfinished tile set")
        .remedy(stream::message("finish it first: make the set again with {resume}"));
  }
  TileLayer layer = read_layer(layer_path);
  TileInventory inventory = take_inventory(request.folder, layer, context);
  const unsigned first = layer.first_zoom;
  const std::vector<std::unique_ptr<TileSurface>> none;
  SetCheck check(request, std::move(layer), resources.threads, source ? source->surfaces() : none,
                 context);
  check.result.problems = std::move(inventory.problems);
  check.result.torn = inventory.torn;
  std::vector<TileAddress> all;
  for (unsigned zoom = 0; zoom < inventory.tiles.size(); ++zoom) {
    check.result.zooms.push_back({.zoom = zoom});
    all.insert(all.end(), inventory.tiles[zoom].begin(), inventory.tiles[zoom].end());
  }
  check.tiles(all);
  if (source) {
    for (unsigned zoom = first; zoom < inventory.tiles.size(); ++zoom) {
      check.absent(zoom, inventory.tiles[zoom]);
    }
  }
  check.result.zooms.erase(check.result.zooms.begin(), check.result.zooms.begin() + first);
  return std::move(check.result);
}

}  // namespace terrace::terrain
