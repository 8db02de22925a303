// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "raster/order.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

/// Maximum number of tiles in a window, which bounds the memory of their list.
constexpr std::uint64_t kMaxTiles = 1u << 18;
constexpr std::size_t kMaxBlockPoints = std::size_t{1} << 40;

double transform_aspect(const WorldTransform& world) {
  const auto& m = world.xy;
  const double width = std::sqrt(m[0] * m[0] + m[3] * m[3]);
  const double height = std::sqrt(m[1] * m[1] + m[4] * m[4]);
  const double aspect = height / width;
  return std::isfinite(aspect) && aspect > 0 ? aspect : 1.0;
}

bool is_wide_integer(ScalarType type) { return type == ScalarType::i64 || type == ScalarType::u64; }

SourceInfo source_info(const RasterInfo& raster, const SourceOptions& options) {
  SourceInfo info;
  info.format = raster.format;
  info.files = raster.files;
  info.grid = true;
  info.coordinates[0].name = "column";
  info.coordinates[1].name = "row";
  info.coordinates[0].type = info.coordinates[1].type = ScalarType::u32;
  info.coordinates[2] = raster.sample;
  if (is_wide_integer(raster.sample.type)) {
    Channel exact = raster.sample;
    exact.name = "sample";
    info.attributes = {exact};
  }
  info.world = raster.world;
  info.crs = options.crs.value_or(raster.crs);
  info.columns = raster.columns;
  info.rows = raster.rows;
  info.points = raster.columns * raster.rows;
  info.nodata = raster.nodata;
  info.comments = raster.comments;
  for (const std::string& note : raster.notes) {
    info.comments.push_back(note);
    info.note += (info.note.empty() ? "" : "; ") + note;
  }
  return info;
}

/// Returns the cells that may be in a region, with some around its border; all cells without a
/// region.
CellWindow cells_in(const SourceInfo& info, const std::optional<Box3>& region) {
  const CellWindow whole{.column = 0, .row = 0, .columns = info.columns, .rows = info.rows};
  if (!region) return whole;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  for (const double x : {region->min[0], region->max[0]}) {
    for (const double y : {region->min[1], region->max[1]}) {
      const std::array<double, 2> place = stored_place(info, {x, y});
      for (std::size_t axis = 0; axis < 2; ++axis) {
        if (!std::isfinite(place[axis])) return whole;
        low[axis] = std::min(low[axis], place[axis]);
        high[axis] = std::max(high[axis], place[axis]);
      }
    }
  }
  // One more cell on each side, because places are rounded.
  const auto cell = [](double place, std::uint64_t count) {
    return static_cast<std::uint64_t>(std::clamp(place, 0.0, static_cast<double>(count)));
  };
  const std::uint64_t left = cell(std::floor(low[0]) - 1, info.columns);
  const std::uint64_t top = cell(std::floor(low[1]) - 1, info.rows);
  return {.column = left,
          .row = top,
          .columns = cell(std::ceil(high[0]) + 2, info.columns) - left,
          .rows = cell(std::ceil(high[1]) + 2, info.rows) - top};
}

std::uint64_t cells_of(const CellWindow& window) { return window.columns * window.rows; }

/// Returns the length of the part of a crop that begins at cell `first`, at most `size` cells. The
/// part ends with a block of the file if possible, so that blocks are decoded once.
std::uint64_t part_length(std::uint64_t first, std::uint64_t size, std::uint64_t total,
                          std::uint64_t crop_begin, std::uint64_t block) {
  if (size >= total - first) return total - first;
  const std::uint64_t begin = crop_begin + first;
  const std::uint64_t end = (begin + size) / block * block;
  return size < block || end <= begin ? size : end - begin;
}

/// Throws Error if the cells are more than a store can hold; reading them would never end.
void check_count(const SourceInfo& info, const CellWindow& crop) {
  constexpr std::uint64_t kMaxReadableCells = std::uint64_t{1} << 48;
  if (cells_of(crop) <= kMaxReadableCells) return;
  throw Error(info.files.front(), fmt::format("has {} x {} cells, more than the limit of 2^48",
                                              crop.columns, crop.rows))
      .remedy(message("select a part ({region}, gdal_translate -srcwin), or correct its size"));
}

/// Implements points_of(): reads a window, then delivers its tiles.
class RasterSource final : public PointSource {
 public:
  RasterSource(std::unique_ptr<Raster> raster, const SourceOptions& options)
      : raster_(std::move(raster)),
        info_(source_info(raster_->info(), options)),
        crop_(cells_in(info_, options.selection.region)),
        stop_(options.stop),
        block_points_(std::clamp<std::size_t>(options.block_points, 1, kMaxBlockPoints)) {
    check_count(info_, crop_);
    progress_.excluded = *info_.points - cells_of(crop_);
    if (cells_of(crop_) == 0) {
      row_ = info_.rows;  // nothing to read
    } else {
      std::array<double, 6>& m = info_.world.xy;
      const auto column = static_cast<double>(crop_.column), row = static_cast<double>(crop_.row);
      m[2] += m[0] * column + m[1] * row;
      m[5] += m[3] * column + m[4] * row;
      info_.columns = crop_.columns;
      info_.rows = crop_.rows;
    }
    info_.points = cells_of(crop_);
    lay_out(transform_aspect(info_.world), window_bytes(options.memory_bytes));
  }

  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    assert(cell_aspect > 0 && column_ == 0 && (row_ == 0 || info_.points == 0));
    const std::uint64_t window = window_bytes(memory_bytes);
    lay_out(cell_aspect, window);
    raster_->set_open_bytes(memory_bytes - window);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] Progress progress() const override { return progress_; }
  [[nodiscard]] std::uint64_t reading_bytes() const override { return reading_bytes_; }

  bool next(PointBlock& block) override {
    block.clear();
    while (block.empty()) {
      if (stop_.stop_requested()) throw Stopped();
      if (next_tile_ == order_.size() && !next_window()) return false;
      if (next_tile_ < order_.size()) emit(order_[next_tile_++], block);
    }
    return true;
  }

 private:
  void lay_out(double cell_aspect, std::uint64_t bytes) {
    aspect_ = cell_aspect;
    const std::size_t cell_bytes = size_of(raster_->info().sample.type) + 1;
    const std::uint64_t cells = std::min(bytes / cell_bytes, kMaxTiles * block_points_ / 2);
    RasterInfo crop = raster_->info();
    crop.columns = info_.columns;
    crop.rows = info_.rows;
    window_size_ = window_size(crop, cells, block_points_, aspect_);
    reading_bytes_ =
        window_size_.columns * window_size_.rows * cell_bytes + raster_->info().held_bytes;
  }

  /// Reads the next window and lists its tiles, none if the window has no valid cells; false after
  /// the last window.
  bool next_window() {
    if (row_ >= info_.rows) return false;
    const RasterInfo& file = raster_->info();
    window_ = {
        .column = column_,
        .row = row_,
        .columns = part_length(column_, window_size_.columns, info_.columns, crop_.column,
                               file.block_columns),
        .rows = part_length(row_, window_size_.rows, info_.rows, crop_.row, file.block_rows)};
    column_ += window_.columns;
    if (column_ == info_.columns) {
      column_ = 0;
      row_ += window_.rows;
    }
    const std::size_t cells = cells_of(window_);
    const ScalarType type = file.sample.type;
    std::fill_n(valid_.begin(), dirty_cells_, std::uint8_t{0});
    dirty_cells_ = 0;
    if (valid_.size() < cells) {
      valid_.resize(cells);
      samples_.resize(cells * size_of(type));
    }
    next_tile_ = 0;
    order_.clear();
    dirty_cells_ = cells;  // even if reading throws
    const CellWindow in_file{.column = crop_.column + window_.column,
                             .row = crop_.row + window_.row,
                             .columns = window_.columns,
                             .rows = window_.rows};
    const bool any = raster_->read_over(
        in_file, {.samples = samples_.data(), .valid = valid_.data(), .stride = window_.columns});
    if (!any) {
      dirty_cells_ = 0;
      progress_.nodata += cells;
      advance_progress(cells);
      return true;
    }
    tiles_ = tiles_of({window_.columns, window_.rows}, block_points_, aspect_);
    order_ = hilbert_order(static_cast<std::uint32_t>(tiles_.columns),
                           static_cast<std::uint32_t>(tiles_.rows));
    return true;
  }

  void advance_progress(std::uint64_t cells) {
    cells_done_ += cells;
    progress_.fraction = static_cast<double>(cells_done_) / static_cast<double>(*info_.points);
  }

  void emit(std::uint32_t tile, PointBlock& block) {
    const std::uint64_t across = tile % tiles_.columns, down = tile / tiles_.columns;
    const std::uint64_t left = across * window_.columns / tiles_.columns;
    const std::uint64_t right = (across + 1) * window_.columns / tiles_.columns;
    const std::uint64_t top = down * window_.rows / tiles_.rows;
    const std::uint64_t bottom = (down + 1) * window_.rows / tiles_.rows;
    const std::uint64_t cells = (right - left) * (bottom - top);
    const ScalarType type = raster_->info().sample.type;
    block.positions.resize(cells);
    block.payload.resize(info_.attributes.empty() ? 0 : cells * size_of(type));
    const std::size_t count = with_type(type, [&](auto sample) {
      return convert<decltype(sample)>(left, right, top, bottom, block);
    });
    block.positions.resize(count);
    if (!info_.attributes.empty()) block.payload.resize(count * size_of(type));
    progress_.points += count;
    progress_.nodata += cells - count;
    advance_progress(cells);
  }

  template <class T>
  std::size_t convert(std::uint64_t left, std::uint64_t right, std::uint64_t top,
                      std::uint64_t bottom, PointBlock& block) {
    const std::size_t width = right - left;
    const double first_column = static_cast<double>(window_.column + left);
    Point3* out = block.positions.data();
    std::byte* exact = block.payload.empty() ? nullptr : block.payload.data();
    for (std::uint64_t r = top; r < bottom; ++r) {
      const std::size_t cell = r * window_.columns + left;
      const T* const samples = reinterpret_cast<const T*>(samples_.data()) + cell;
      const std::uint8_t* const valid = valid_.data() + cell;
      const double row = static_cast<double>(window_.row + r);
      const bool all_valid = std::memchr(valid, 0, width) == nullptr;
      if (all_valid) {
        for (std::size_t i = 0; i < width; ++i) {
          out[i] = {first_column + static_cast<double>(i), row, static_cast<double>(samples[i])};
        }
        out += width;
      } else {
        for (std::size_t i = 0; i < width; ++i) {  // writes every cell, but only valid ones advance
          *out = {first_column + static_cast<double>(i), row, static_cast<double>(samples[i])};
          out += valid[i];
        }
      }
      if (exact == nullptr) continue;
      for (std::size_t i = 0; i < width; ++i) {
        if (valid[i] == 0) continue;
        std::memcpy(exact, samples + i, sizeof(T));
        exact += sizeof(T);
      }
    }
    return static_cast<std::size_t>(out - block.positions.data());
  }

  std::unique_ptr<Raster> raster_;
  SourceInfo info_;  ///< with columns and rows counted from the crop's first cell
  CellWindow crop_;  ///< of the file, around Selection::region
  std::stop_token stop_;
  std::size_t block_points_;
  double aspect_ = 1;
  GridSize window_size_;
  std::uint64_t reading_bytes_ = 0;

  std::uint64_t column_ = 0, row_ = 0;  // where the next window begins
  CellWindow window_;                   // of the crop
  std::vector<std::byte> samples_;      // of the window
  std::vector<std::uint8_t> valid_;
  std::size_t dirty_cells_ = 0;  // number of cells at the front of valid_ that may not be zero
  GridSize tiles_;
  std::vector<std::uint32_t> order_;  // of the window's tiles
  std::size_t next_tile_ = 0;
  std::uint64_t cells_done_ = 0;
  Progress progress_;
};

}  // namespace

std::unique_ptr<PointSource> points_of(std::unique_ptr<Raster> raster,
                                       const SourceOptions& options) {
  return std::make_unique<RasterSource>(std::move(raster), options);
}

}  // namespace terrace::stream
