// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/memory_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include <fmt/core.h>

#include "format/missing.hpp"
#include "format/selection.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

const std::byte* value_of_column(const MemoryColumn& column, std::uint64_t index) {
  return column.first + static_cast<std::ptrdiff_t>(index) * column.stride;
}

/// Delivers points from columns in memory.
class ColumnSource final : public PointSource {
 public:
  ColumnSource(MemoryPoints points, const SourceOptions& options)
      : points_(std::move(points)), block_points_(std::max<std::size_t>(options.block_points, 1)) {
    if (points_.attributes.size() != points_.info.attributes.size()) {
      throw std::invalid_argument(
          fmt::format("there are {} for {}", counted(points_.attributes.size(), "column"),
                      counted(points_.info.attributes.size(), "attribute")));
    }
    points_.info.points = points_.count;
    if (options.crs) points_.info.crs = *options.crs;
  }

  [[nodiscard]] const SourceInfo& info() const override { return points_.info; }
  [[nodiscard]] Progress progress() const override {
    return {.points = read_ - nodata_,
            .nodata = nodata_,
            .fraction = points_.count == 0
                            ? 1.0
                            : static_cast<double>(read_) / static_cast<double>(points_.count)};
  }

  bool next(PointBlock& block) override {
    block.clear();
    while (block.empty() && read_ < points_.count) read(block);
    return !block.empty();
  }

 private:
  void read(PointBlock& block) {
    const auto size =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_points_, points_.count - read_));
    block.positions.resize(size);
    bool missing = false;
    for (std::size_t axis = 0; axis < 3; ++axis) missing |= fill_axis(axis, block);
    const SourceInfo& info = points_.info;
    const std::size_t record = info.payload_size();
    block.payload.resize(size * record);
    for (std::size_t a = 0; a < points_.attributes.size(); ++a) {
      const std::size_t bytes = size_of(info.attributes[a].type);
      std::byte* to = block.payload.data() + info.attribute_offset(a);
      for (std::size_t i = 0; i < size; ++i, to += record) {
        std::memcpy(to, value_of_column(points_.attributes[a], read_ + i), bytes);
      }
    }
    read_ += size;
    if (missing) nodata_ += remove_missing(block, record);
  }

  /// Copies one coordinate of all points of the block; returns whether one of them is NaN.
  bool fill_axis(std::size_t axis, PointBlock& block) const {
    bool missing = false;
    with_type(points_.info.coordinates[axis].type, [&]<class T>(T number) {
      for (std::size_t i = 0; i < block.positions.size(); ++i) {
        std::memcpy(&number, value_of_column(points_.coordinates[axis], read_ + i), sizeof number);
        const auto value = static_cast<double>(number);
        missing = missing || std::isnan(value);
        if (std::isinf(value)) {
          throw Error(points_.info.files.empty() ? "" : points_.info.files.front(),
                      "its " + points_.info.coordinates[axis].name + " is infinite")
              .at(fmt::format("point {}", read_ + i))
              .remedy("leave such points out");
        }
        block.positions[i][axis] = value;
      }
    });
    return missing;
  }

  MemoryPoints points_;
  std::size_t block_points_;
  std::uint64_t read_ = 0, nodata_ = 0;
};

/// A raster whose samples are an array in memory.
class SampleArray final : public Raster {
 public:
  explicit SampleArray(const MemoryRaster& raster) : raster_(raster) {}

  [[nodiscard]] const RasterInfo& info() const override { return raster_.info; }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    return with_type(raster_.info.sample.type, [&]<class T>(T sample) {
      bool any = false;
      for (std::uint64_t r = 0; r < window.rows; ++r) {
        const MemoryColumn row{
            raster_.first + static_cast<std::ptrdiff_t>(window.row + r) * raster_.row_stride,
            raster_.column_stride};
        for (std::uint64_t c = 0; c < window.columns; ++c) {
          std::memcpy(&sample, value_of_column(row, window.column + c), sizeof sample);
          if (!has_data(sample)) continue;
          const std::size_t cell = r * out.stride + c;
          std::memcpy(out.samples + cell * sizeof sample, &sample, sizeof sample);
          out.valid[cell] = 1;
          any = true;
        }
      }
      return any;
    });
  }

 private:
  template <class T>
  [[nodiscard]] bool has_data(T sample) const {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(sample)) return false;
    }
    return !raster_.info.nodata || static_cast<double>(sample) != *raster_.info.nodata;
  }

  MemoryRaster raster_;
};

std::unique_ptr<PointSource> memory_selection(std::unique_ptr<PointSource> source,
                                              const SourceOptions& options) {
  source = selection_of(std::move(source), options);
  if (options.blocks_ahead == 0) return source;
  return read_ahead(std::move(source), options.blocks_ahead, std::stop_source(std::nostopstate),
                    options.stop);
}

}  // namespace

std::unique_ptr<PointSource> open_memory(MemoryPoints points, const SourceOptions& options) {
  return memory_selection(std::make_unique<ColumnSource>(std::move(points), options), options);
}

std::unique_ptr<PointSource> open_memory(const MemoryRaster& raster, const SourceOptions& options) {
  return memory_selection(points_of(std::make_unique<SampleArray>(raster), options), options);
}

}  // namespace terrace::stream
