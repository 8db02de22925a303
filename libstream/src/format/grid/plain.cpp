// SPDX-License-Identifier: Apache-2.0
#include "format/grid/plain.hpp"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/packed_column.hpp"
#include "io/text.hpp"
#include "raster/nodata.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMaxGridCells = 1u << 30;
/// Bytes read at a time.
constexpr std::uint64_t kReadBytes = 256u << 10;

/// Reads windows of a PlainGrid row by row.
class PlainRaster final : public Raster {
 public:
  PlainRaster(PlainGrid grid, std::unique_ptr<ByteSource> bytes,
              std::function<std::unique_ptr<ByteSource>()> unpack)
      : grid_(std::move(grid)),
        size_(size_of(grid_.info.sample.type)),
        bytes_(std::move(bytes)),
        unpack_(std::move(unpack)) {
    grid_.info.held_bytes += std::max(kReadBytes, grid_.sample_step * size_);
    if (bytes_) check();
  }

  [[nodiscard]] const RasterInfo& info() const override { return grid_.info; }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    if (!bytes_) {
      bytes_ = unpack_();
      check();
    }
    const std::uint64_t step = grid_.sample_step * size_;
    const std::uint64_t at_once = std::max<std::uint64_t>(kReadBytes / step, 1);
    bool any = false;
    for (std::uint64_t row = 0; row < window.rows; ++row) {
      for (std::uint64_t column = 0; column < window.columns; column += at_once) {
        const std::uint64_t cells = std::min(at_once, window.columns - column);
        const std::uint64_t samples = (cells - 1) * grid_.sample_step + 1;
        piece_.resize(samples * size_);
        bytes_->read(
            grid_.first + (window.row + row) * grid_.row_bytes + (window.column + column) * step,
            piece_);
        if (grid_.order != std::endian::native) {
          const PackedColumn swapped{.rows = reinterpret_cast<const char*>(piece_.data()),
                                     .stride = size_,
                                     .count = samples,
                                     .type = grid_.info.sample.type,
                                     .swap = true};
          decode_values(swapped, piece_.data(), size_);
        }
        const std::size_t cell = row * out.stride + column;
        any |= overlay_row(grid_.info.sample.type,
                           {.samples = piece_.data(), .step = grid_.sample_step, .cells = cells},
                           grid_.nodata, out.samples + cell * size_, out.valid + cell);
      }
    }
    return any;
  }

 private:
  void check() const {
    const RasterInfo& info = grid_.info;
    const std::uint64_t row = ((info.columns - 1) * grid_.sample_step + 1) * size_;
    const std::uint64_t present = bytes_->size() > grid_.first ? bytes_->size() - grid_.first : 0;
    if (present >= row && (present - row) / grid_.row_bytes >= info.rows - 1) return;
    throw grid_fault(bytes_->name(), fmt::format("has {}, too few for {} x {} samples of {}",
                                                 counted(bytes_->size(), "byte"), info.columns,
                                                 info.rows, name_of(info.sample.type)));
  }

  PlainGrid grid_;
  std::size_t size_;
  std::unique_ptr<ByteSource> bytes_;
  std::function<std::unique_ptr<ByteSource>()> unpack_;
  std::vector<std::byte> piece_;
};

}  // namespace

Error grid_fault(std::string file, std::string cause) {
  return Error(std::move(file), std::move(cause)).remedy(kDownloadRemedy);
}

PlainGrid plain_grid(std::string format, const std::string& file, std::uint64_t columns,
                     std::uint64_t rows, ScalarType type, const std::string& nodata) {
  if (columns == 0 || rows == 0 || columns >= kMaxGridCells || rows >= kMaxGridCells) {
    throw grid_fault(
        file,
        fmt::format("{} x {} cells: columns and rows must each be at least 1 and fewer than 2^30",
                    columns, rows))
        .remedy("check its header, or split it (gdal_translate -srcwin)");
  }
  PlainGrid grid;
  grid.info.format = std::move(format);
  grid.info.files = {file};
  grid.info.columns = columns;
  grid.info.rows = rows;
  grid.info.sample = {.name = "height", .type = type};
  set_nodata(nodata, grid);
  grid.row_bytes = columns * size_of(type);
  return grid;
}

void set_nodata(const std::string& text, PlainGrid& grid) {
  const ScalarType type = grid.info.sample.type;
  grid.nodata = NodataRule::parse(text, type);
  grid.info.nodata = grid.nodata.value;
  if (grid.nodata.unmatched) {
    grid.info.comments.push_back(
        fmt::format("nodata {} is not a value of type {}", text, name_of(type)));
  }
}

void check_band(const std::string& file, int band, std::uint64_t bands) {
  if (band >= 1 && static_cast<std::uint64_t>(band) <= bands) return;
  throw grid_fault(file, fmt::format("has no band {}, only {}", band, bands))
      .remedy("choose another band");
}

std::unique_ptr<Raster> open_plain_grid(PlainGrid grid, std::unique_ptr<ByteSource> bytes) {
  return std::make_unique<PlainRaster>(std::move(grid), std::move(bytes), nullptr);
}

std::unique_ptr<Raster> open_packed_grid(PlainGrid grid,
                                         std::function<std::unique_ptr<ByteSource>()> unpack) {
  return std::make_unique<PlainRaster>(std::move(grid), nullptr, std::move(unpack));
}

}  // namespace terrace::stream
