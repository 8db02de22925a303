// SPDX-License-Identifier: Apache-2.0
#include "tile/set/tile_set_writer.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "base/ordered_work.hpp"
#include "base/progress_report.hpp"
#include "tile/format/tile_layer.hpp"
#include "tile/make/sample_parts.hpp"
#include "tile/set/tile_file.hpp"
#include "tile/set/tile_inputs.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// Tiles that may have data, sorted by row, then column. The two of zoom 0 always count.
std::vector<TileAddress> candidates(unsigned zoom, TileSurface& surface, const Context& context) {
  if (zoom == 0) return {{0, 0, 0}, {0, 1, 0}};
  return tiles_with_samples(surface, zoom, context);
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

}  // namespace

void TileSetWriter::begin_change() {
  std::call_once(changed_, [this] {
    std::error_code error;
    fs::remove(layer_path_, error);
    if (error) throw stream::system_error(layer_path_, "cannot be removed", error.value());
    // Not to be there again after a power cut that tiles have survived.
    sync_names(options_.folder);
  });
}

TileSetWriter::Written TileSetWriter::write_tile(const TileAddress& tile, const ZoomPlan& plan,
                                                 TileSurface& surface, SharedSides& sides) {
  context_.check_stop();
  TileInputs inputs{options_.mesh(), options_.request.gzip, options_.source_options, {}};
  if (options_.request.metadata) inputs.metadata = children_json(tile, deeper_);
  const std::uint64_t digest = digest_of(tile, plan, inputs, surface);
  const std::string path = options_.folder + "/" + tile_path(tile);
  std::vector<std::byte> before;
  if (const FinishedTile* earlier = journal_.find(tile);
      earlier != nullptr && earlier->inputs == digest) {
    if (earlier->bytes == 0) return {false, true, *earlier};
    before = read_tile_file(path);
    if (before.size() == earlier->bytes && checksum_of(before) == earlier->checksum) {
      return {false, true, *earlier};
    }
  }
  MadeTile made = make_tile(tile, plan, surface, options_.mesh(), &sides);
  if (!made.has_data && tile.zoom > 0) return {true, true, {.inputs = digest}};
  made.mesh.metadata = std::move(inputs.metadata);
  std::vector<std::byte> bytes = encode_tile(made.mesh, made.header);
  if (options_.request.gzip) bytes = stream::gzip(bytes);
  if (before.empty()) before = read_tile_file(path);
  const Written written{
      true, bytes == before, {bytes.size(), checksum_of(bytes), digest, made.max_error}};
  if (!written.kept) {
    begin_change();
    write_tile_file(path, bytes);
  }
  return written;
}

void TileSetWriter::write_zooms() {
  TileSurface& surface = *surfaces_.front();
  std::vector<std::unique_ptr<Zoom>> zooms;
  for (unsigned zoom = options_.last_zoom + 1; zoom-- > options_.request.first_zoom;) {
    auto begun = std::make_unique<Zoom>();
    begun->tiles = candidates(zoom, surface, context_);
    // A quarter more, for what is filled beside the samples.
    begun->range = 1.25 * widest_range(begun->tiles, surface);
    begun->plan = plan_zoom(zoom, options_.max_error(zoom), begun->range, surface);
    zooms.push_back(std::move(begun));
  }
  // Metadata of a tile needs those of the next zoom below finished. Else all zooms are one queue:
  // the upper ones have fewer tiles than there may be threads.
  const std::size_t together = options_.request.metadata ? 1 : zooms.size();
  for (std::size_t first = 0; first < zooms.size(); first += together) {
    std::vector<Zoom*> open;
    for (std::size_t i = 0; i < together; ++i) open.push_back(zooms[first + i].get());
    while (!open.empty()) {
      write_tiles(open);
      std::erase_if(open, [](const Zoom* zoom) { return !zoom->too_far; });
      for (Zoom* zoom : open) take_larger_steps(*zoom);
    }
    for (std::size_t i = 0; i < together; ++i) conclude(*zooms[first + i]);
  }
}

void TileSetWriter::write_tiles(const std::vector<Zoom*>& zooms) {
  std::vector<std::pair<Zoom*, std::size_t>> queue;
  for (Zoom* zoom : zooms) {
    zoom->written.clear();
    for (std::size_t i = 0; i < zoom->tiles.size(); ++i) queue.emplace_back(zoom, i);
  }
  ProgressReport report(context_, "tiles");
  in_order(
      queue.size(), static_cast<unsigned>(surfaces_.size()),
      [&](unsigned worker, std::size_t i) {
        const auto& [zoom, number] = queue[i];
        if (!zoom->too_far) {
          try {
            return write_tile(zoom->tiles[number], zoom->plan, *surfaces_[worker], zoom->sides);
          } catch (const HeightsTooFar&) {
            zoom->too_far = true;
          }
        }
        return Written{};
      },
      [&](std::size_t i, const Written& written) {
        report.update(result.tiles + i,
                      static_cast<double>(i + 1) / static_cast<double>(queue.size()));
        const auto& [zoom, number] = queue[i];
        if (written.made) journal_.add(zoom->tiles[number], written.finished);
        zoom->written.push_back(written);
        if (number + 1 == zoom->tiles.size()) zoom->sides.clear();
      });
}

void TileSetWriter::take_larger_steps(Zoom& zoom) {
  if (zoom.range > 1e7) {
    throw stream::Error({.file = options_.folder,
                         .where = "zoom " + std::to_string(zoom.plan.zoom),
                         .cause = "heights beyond 10,000 km have no place on a globe",
                         .remedy = "look at the unit and the nodata value of the source"});
  }
  zoom.range = std::max(1.0, 2.0 * zoom.range);
  zoom.plan = plan_zoom(zoom.plan.zoom, zoom.plan.max_error, zoom.range, *surfaces_.front());
  zoom.sides.clear();
  zoom.too_far = false;
}

void TileSetWriter::conclude(const Zoom& zoom) {
  std::vector<TileAddress>& there = present[zoom.plan.zoom];
  TileZoom summary{.zoom = zoom.plan.zoom};
  for (std::size_t i = 0; i < zoom.tiles.size(); ++i) {
    const Written& written = zoom.written[i];
    records_.emplace_back(zoom.tiles[i], written.finished);
    if (written.finished.bytes == 0) continue;
    there.push_back(zoom.tiles[i]);
    result.bytes += written.finished.bytes;
    result.made += written.made ? 1 : 0;
    result.kept += written.kept ? 1 : 0;
    summary.max_error = std::max(summary.max_error, written.finished.max_error);
  }
  summary.tiles = there.size();
  result.tiles += there.size();
  result.zooms.insert(result.zooms.begin(), summary);
  deeper_ = {there.begin(), there.end()};
}

void TileSetWriter::remove_others() {
  std::vector<fs::path> gone, torn;
  for (const auto& entry : fs::recursive_directory_iterator(options_.folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(options_.folder).generic_string();
    if (is_torn_tile(name)) torn.push_back(entry.path());
    const auto tile = parse_tile_path(name);
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
  if (!gone.empty()) begin_change();
  const auto remove = [](const fs::path& path) {
    fs::remove(path);
    // Fails on folders that are not empty, as it should.
    std::error_code ignored;
    if (fs::remove(path.parent_path(), ignored)) {
      fs::remove(path.parent_path().parent_path(), ignored);
    }
  };
  std::ranges::for_each(gone, remove);
  std::ranges::for_each(torn, remove);
  result.removed = gone.size();
}

void TileSetWriter::finish() {
  remove_others();
  sync_files(options_.folder);
  journal_.finish(std::move(records_));
}

}  // namespace terrace::terrain
