// SPDX-License-Identifier: Apache-2.0
#include "tile/set/writer.hpp"

#include <algorithm>
#include <cassert>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "base/parallel.hpp"
#include "base/progress_report.hpp"
#include "tile/format/layer.hpp"
#include "tile/make/sample_parts.hpp"
#include "tile/set/file.hpp"
#include "tile/set/inputs.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// The minimum, so that threads finish at about the same time.
constexpr std::size_t kFamiliesPerThread = 8;

/// Returns the tiles that may have data, sorted by row, then column. Always includes the two of
/// zoom 0.
std::vector<TileAddress> candidates(unsigned zoom, TileSurface& surface, const Context& context) {
  if (zoom == 0) return {{0, 0, 0}, {0, 1, 0}};
  return tiles_with_samples(surface, zoom, context);
}

/// Returns the largest range of heights within a tile, as far as it is known without reading.
double widest_range(const std::vector<TileAddress>& tiles, TileSurface& surface) {
  double widest = 0.0;
  const GeographicBox data = surface.bounds();
  for (const TileAddress& tile : tiles) {
    surface.check_stop();
    const GeographicBox box = box_of(tile);
    auto range = surface.range(box);
    if (!range) continue;
    if (box.west < data.west || box.east > data.east || box.south < data.south ||
        box.north > data.north) {
      range->low = std::min(range->low, surface.height_beyond());
      range->high = std::max(range->high, surface.height_beyond());
    }
    widest = std::max(widest, range->high - range->low);
  }
  return widest;
}

/// Returns the index of a tile among tiles sorted by row.
std::optional<std::size_t> number_of(const TileAddress& tile,
                                     const std::vector<TileAddress>& tiles) {
  const auto position = std::lower_bound(tiles.begin(), tiles.end(), tile, by_row);
  if (position == tiles.end() || *position != tile) return std::nullopt;
  return static_cast<std::size_t>(position - tiles.begin());
}

}  // namespace

bool TileSetWriter::is_stranger(const TileAddress& tile) const {
  if (!finished_) return false;
  if (const FinishedTile* record = journal_.find(tile); record && record->bytes > 0) return false;
  const auto& available = finished_->available;
  return tile.zoom >= available.size() ||
         std::ranges::none_of(available[tile.zoom], [&](const TileRange& range) {
           return range.x0 <= tile.x && tile.x <= range.x1 && range.y0 <= tile.y &&
                  tile.y <= range.y1;
         });
}

void TileSetWriter::check_strangers() const {
  if (!finished_) return;
  std::string first;
  std::error_code error;
  fs::recursive_directory_iterator at(options_.folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    const std::string name = at->path().lexically_relative(options_.folder).generic_string();
    const auto tile = parse_tile_path(name);
    if (tile && is_stranger(*tile) && (first.empty() || name < first)) first = name;
  }
  if (error) throw stream::system_error(options_.folder, "cannot be listed", error.value());
  if (first.empty()) return;
  throw stream::not_replaced(options_.folder, stream::Ownership::except(first));
}

void TileSetWriter::begin_change() {
  std::call_once(changed_, [this] {
    std::error_code error;
    fs::remove(layer_path_, error);
    if (error) throw stream::system_error(layer_path_, "cannot be removed", error.value());
    // Sync the folder, so that the file does not reappear after a power failure that the tiles
    // survived.
    sync_names(options_.folder);
  });
}

std::string TileSetWriter::children_json(const TileAddress& tile) const {
  std::vector<TileAddress> children;
  // Metadata begin at zoom 0, so zooms_ is indexed by zoom.
  if (tile.zoom + 1 < zooms_.size()) {
    const Zoom& below = *zooms_[tile.zoom + 1];
    for (const TileAddress& child : children_of(tile)) {
      const auto number = number_of(child, below.tiles);
      if (number && below.written[*number].finished.bytes > 0) children.push_back(child);
    }
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const TileRange& range : ranges_of(children)) {
    list.push_back(
        {{"startX", range.x0}, {"startY", range.y0}, {"endX", range.x1}, {"endY", range.y1}});
  }
  return nlohmann::ordered_json{{"available", {list}}}.dump();
}

TileSetWriter::Written TileSetWriter::write_tile(const TileAddress& tile, Zoom& zoom,
                                                 TileSurface& surface) {
  context_.check_stop();
  TileInputs inputs{options_.mesh(), options_.request.gzip, options_.source_options, {}};
  if (options_.request.metadata) inputs.metadata = children_json(tile);
  const std::uint64_t digest = digest_of(tile, zoom.plan, inputs, surface);
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
  BuiltTile built = make_tile(tile, zoom.plan, surface, options_.mesh(), &zoom.sides);
  if (!built.has_data && tile.zoom > 0) return {true, true, {.inputs = digest}};
  built.mesh.metadata = std::move(inputs.metadata);
  std::vector<std::byte> bytes = encode_tile(built.mesh, built.header);
  if (options_.request.gzip) bytes = stream::gzip(bytes);
  if (before.empty()) before = read_tile_file(path);
  if (!before.empty() && !repeats_ && is_stranger(tile)) throw stream::not_replaced(path, false);
  const Written written{
      true, bytes == before, {bytes.size(), checksum_of(bytes), digest, built.max_error}};
  if (!written.kept) {
    begin_change();
    write_tile_file(path, bytes);
  }
  return written;
}

void TileSetWriter::begin_zooms() {
  TileSurface& surface = *surfaces_.front();
  for (unsigned zoom = options_.request.first_zoom; zoom <= options_.last_zoom; ++zoom) {
    auto begun = std::make_unique<Zoom>();
    begun->tiles = candidates(zoom, surface, context_);
    // Add a quarter, for the fill next to samples.
    begun->range = 1.25 * widest_range(begun->tiles, surface);
    begun->plan = plan_zoom(zoom, options_.max_error(zoom), begun->range, surface);
    zooms_.push_back(std::move(begun));
  }
}

void TileSetWriter::add_to(Family& family, std::size_t zoom, std::size_t number) {
  if (zoom + 1 < zooms_.size()) {
    for (const TileAddress& child : children_of(zooms_[zoom]->tiles[number])) {
      if (const auto below = number_of(child, zooms_[zoom + 1]->tiles)) {
        add_to(family, zoom + 1, *below);
      }
    }
  }
  if (zooms_[zoom]->open) family.emplace_back(zooms_[zoom].get(), number);
}

void TileSetWriter::add_families(std::vector<Family>& stage, std::size_t zoom, std::size_t number,
                                 std::size_t last) {
  Family family;
  if (zoom == last) {
    add_to(family, zoom, number);
  } else {
    for (const TileAddress& child : children_of(zooms_[zoom]->tiles[number])) {
      if (const auto below = number_of(child, zooms_[zoom + 1]->tiles)) {
        add_families(stage, zoom + 1, *below, last);
      }
    }
    if (zooms_[zoom]->open) family.emplace_back(zooms_[zoom].get(), number);
  }
  stage.push_back(std::move(family));
}

std::vector<std::vector<TileSetWriter::Family>> TileSetWriter::stages() {
  // The uppermost zoom with enough tiles for all threads; the tiles above it are written one by
  // one.
  std::size_t zoom = zooms_.size() - 1;
  while (zoom > 0 && zooms_[zoom - 1]->tiles.size() >= kFamiliesPerThread * surfaces_.size()) {
    --zoom;
  }
  std::vector<std::vector<Family>> stages(1);
  const auto add_zoom = [&](std::size_t above) {
    if (!zooms_[above]->open) return;
    for (std::size_t i = 0; i < zooms_[above]->tiles.size(); ++i) {
      stages.back().push_back({{zooms_[above].get(), i}});
    }
  };
  // Start with the largest tiles, so that not only a few threads work at the end. With metadata a
  // tile needs its children first, so each zoom waits for the one below.
  std::size_t first = options_.request.metadata ? zoom : 0;
  while (first < zoom && zooms_[first]->tiles.size() < surfaces_.size()) add_zoom(first++);
  for (std::size_t i = 0; i < zooms_[first]->tiles.size(); ++i) {
    add_families(stages.back(), first, i, zoom);
  }
  for (std::size_t above = zoom; options_.request.metadata && above-- > 0;) {
    stages.emplace_back();
    add_zoom(above);
  }
  return stages;
}

void TileSetWriter::write(const Family& family, TileSurface& surface,
                          const std::function<void(const TileAddress&, const Written&)>& done) {
  for (const auto& [zoom, number] : family) {
    if (zoom->range_too_large) continue;
    const TileAddress& tile = zoom->tiles[number];
    try {
      zoom->written[number] = write_tile(tile, *zoom, surface);
      done(tile, zoom->written[number]);
    } catch (const HeightRangeTooLarge&) {
      zoom->range_too_large = true;
    }
  }
}

void TileSetWriter::write_zooms() {
  begin_zooms();
  ProgressReport report(context_, "tiles");
  for (bool again = true; again;) {
    std::size_t tiles = 0, finished = 0;
    for (const auto& zoom : zooms_) {
      if (!zoom->open) continue;
      tiles += zoom->tiles.size();
      zoom->written.assign(zoom->tiles.size(), {});
    }
    std::mutex mutex;
    const auto done = [&](const TileAddress& tile, const Written& written) {
      const std::lock_guard lock(mutex);
      if (written.made) journal_.add(tile, written.finished);
      ++finished;
      report.update(finished, static_cast<double>(finished) / static_cast<double>(tiles));
    };
    for (const std::vector<Family>& stage : stages()) {
      parallel_for(
          stage.size(), static_cast<unsigned>(surfaces_.size()),
          [&](std::size_t i, unsigned worker) { write(stage[i], *surfaces_[worker], done); },
          context_.stop);
    }
    // Every tile is also below one of the zoom above that may have data.
    assert(finished == tiles || std::ranges::any_of(zooms_, [](const auto& zoom) {
             return zoom->range_too_large.load();
           }));
    again = false;
    for (auto zoom = zooms_.rbegin(); zoom != zooms_.rend(); ++zoom) {
      (*zoom)->sides.clear();
      // The metadata above list which of these tiles exist.
      (*zoom)->open = (*zoom)->range_too_large || (again && options_.request.metadata);
      if ((*zoom)->range_too_large) take_larger_steps(**zoom);
      again = again || (*zoom)->open;
    }
    repeats_ = again;
  }
  for (auto zoom = zooms_.rbegin(); zoom != zooms_.rend(); ++zoom) conclude(**zoom);
}

void TileSetWriter::take_larger_steps(Zoom& zoom) {
  if (zoom.range > 1e7) {
    throw stream::Error(options_.folder, "the heights are beyond the limit of 10,000 km")
        .at(fmt::format("zoom {}", zoom.plan.zoom))
        .remedy("check the unit and the nodata value of the source");
  }
  zoom.range = std::max(1.0, 2.0 * zoom.range);
  zoom.plan =
      plan_zoom(zoom.plan.zoom, options_.max_error(zoom.plan.zoom), zoom.range, *surfaces_.front());
  zoom.range_too_large = false;
}

void TileSetWriter::conclude(const Zoom& zoom) {
  std::vector<TileAddress>& existing = present[zoom.plan.zoom];
  TileZoom summary{.zoom = zoom.plan.zoom};
  for (std::size_t i = 0; i < zoom.tiles.size(); ++i) {
    const Written& written = zoom.written[i];
    records_.emplace_back(zoom.tiles[i], written.finished);
    if (written.finished.bytes == 0) continue;
    existing.push_back(zoom.tiles[i]);
    result.bytes += written.finished.bytes;
    result.made += written.made ? 1 : 0;
    result.kept += written.kept ? 1 : 0;
    summary.max_error = std::max(summary.max_error, written.finished.max_error);
  }
  summary.tiles = existing.size();
  result.tiles += existing.size();
  result.zooms.insert(result.zooms.begin(), summary);
}

void TileSetWriter::remove_others() {
  std::vector<fs::path> obsolete, torn;
  std::error_code error;
  fs::recursive_directory_iterator at(options_.folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    std::error_code vanished;
    if (!at->is_regular_file(vanished)) continue;
    const fs::path& path = at->path();
    const std::string name = path.lexically_relative(options_.folder).generic_string();
    if (is_torn_tile(name)) torn.push_back(path);
    const auto tile = parse_tile_path(name);
    if (!tile) continue;
    if (tile->zoom >= present.size() || !number_of(*tile, present[tile->zoom])) {
      if (is_stranger(*tile)) throw stream::not_replaced(path.string(), false);
      obsolete.push_back(path);
    }
  }
  if (error) throw stream::system_error(options_.folder, "cannot be listed", error.value());
  if (!obsolete.empty()) begin_change();
  const auto remove = [](const fs::path& path) {
    fs::remove(path);
    // Fails on folders that are not empty, as intended.
    std::error_code ignored;
    if (fs::remove(path.parent_path(), ignored)) {
      fs::remove(path.parent_path().parent_path(), ignored);
    }
  };
  std::ranges::for_each(obsolete, remove);
  std::ranges::for_each(torn, remove);
  result.removed = obsolete.size();
}

void TileSetWriter::finish() {
  remove_others();
  sync_files(options_.folder);
  journal_.finish(std::move(records_));
}

}  // namespace terrace::terrain
