// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/grid/binary.hpp"
#include "format/grid/rasters.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "format/vrt/document.hpp"
#include "io/number.hpp"
#include "io/peek.hpp"
#include "raster/nodata.hpp"
#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

bool recognise_vrt(std::span<const std::byte> head) {
  return std::string_view(reinterpret_cast<const char*>(head.data()), head.size())
             .substr(0, 512)
             .find("<VRTDataset") != std::string_view::npos;
}

/// Opens a raster of any format except VRT, recognised by content, then by ending.
std::unique_ptr<Raster> open_member(const std::string& file, const RasterOptions& options) {
  struct Kind {
    const Format& (*format)();
    std::unique_ptr<Raster> (*open)(const std::string& file, const RasterOptions& options);
  };
  static constexpr std::array<Kind, 6> kKinds{
      {{&geotiff_format, &open_geotiff},
       {&hgt_format, &open_hgt},
       {&ascii_grid_format,
        [](const std::string& name, const RasterOptions& opening) {
          return open_ascii_grid(name, {}, {}, opening.nodata);
        }},
       {&usgs_dem_format,
        [](const std::string& name, const RasterOptions&) { return open_usgs_dem(name); }},
       {&png_format, &open_height_map},
       {&binary_grid_format, &open_binary_grid}}};
  constexpr std::size_t kRecognisedBytes = 4096;
  const std::vector<char> head = peek_head(file, kRecognisedBytes, {});
  if (recognise_vrt(std::as_bytes(std::span(head)))) {
    throw Error(file, "is a virtual raster inside another, which is not supported")
        .remedy(
            "name the rasters of both: gdalbuildvrt, or convert it to GeoTIFF: gdal_translate FILE "
            "out.tif");
  }
  for (const Kind& kind : kKinds) {
    if (kind.format().recognise(std::as_bytes(std::span(head)))) return kind.open(file, options);
  }
  const Format* const named_format = format_of_name(file);
  for (const Kind& kind : kKinds) {
    if (named_format != nullptr && named_format->name == kind.format().name)
      return kind.open(file, options);
  }
  return open_geotiff(file, options);
}

/// An ASCII grid with integer samples: we read its whole numbers as reals, GDAL as integers.
class WholeNumbers final : public Raster {
 public:
  WholeNumbers(std::unique_ptr<Raster> raster, ScalarType type)
      : raster_(std::move(raster)), info_(raster_->info()) {
    info_.sample.type = type;
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  void set_open_bytes(std::uint64_t bytes) override { raster_->set_open_bytes(bytes); }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    const ScalarType source_type = raster_->info().sample.type;
    const auto columns = static_cast<std::size_t>(window.columns);
    reals_.resize(columns * size_of(source_type));
    bool any = false;
    for (std::uint64_t row = 0; row < window.rows; ++row) {
      valid_.assign(columns, 0);
      raster_->read_over(
          {.column = window.column, .row = window.row + row, .columns = window.columns, .rows = 1},
          {.samples = reals_.data(), .valid = valid_.data(), .stride = columns});
      for (std::size_t i = 0; i < columns; ++i) {
        if (valid_[i] == 0) continue;
        const std::size_t target = static_cast<std::size_t>(row) * out.stride + i;
        put(to_double(source_type, reals_.data() + i * size_of(source_type)), out.samples, target);
        out.valid[target] = 1;
        any = true;
      }
    }
    return any;
  }

 private:
  void put(double real, std::byte* samples, std::size_t target) const {
    with_type(info_.sample.type, [&]<class T>(T) {
      // Both limits are exact: the upper one is the power of two after the largest value.
      const double end = std::ldexp(1.0, std::numeric_limits<T>::digits);
      if (!(real >= static_cast<double>(std::numeric_limits<T>::min()) && real < end) ||
          real != std::trunc(real)) {
        throw Error(
            info_.files.front(),
            fmt::format("has samples that are not {}, the sample type of the virtual raster",
                        name_of(info_.sample.type)))
            .remedy("rebuild the virtual raster: gdalbuildvrt");
      }
      const T number = static_cast<T>(real);
      std::memcpy(samples + target * sizeof number, &number, sizeof number);
    });
  }

  std::unique_ptr<Raster> raster_;
  RasterInfo info_;
  std::vector<std::byte> reals_;
  std::vector<std::uint8_t> valid_;
};

/// Composes a window from the sources that overlap it.
class VrtRaster final : public Raster {
 public:
  VrtRaster(const std::string& file, const RasterOptions& options)
      : options_(options), open_bytes_(options.memory_bytes) {
    VrtDocument document = read_vrt(file, options.band);
    info_ = std::move(document.info);
    sources_ = std::move(document.sources);
    nodata_ = document.nodata;
    source_bytes_.resize(sources_.size());
    options_.cache_bytes /= kOpenAtOnce / 4;  // few of them overlap one window
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const std::unique_ptr<Raster> raster = open(sources_[i], std::nullopt);
      source_bytes_[i] = raster->info().held_bytes;
      direct_ = direct_ && is_direct(sources_[i], raster->info());
      info_.held_bytes = std::max(info_.held_bytes, source_bytes_[i]);
      note_own_nodata(sources_[i], raster->info());
      if (i == 0 && info_.crs.wkt.empty() && info_.crs.epsg == 0) {
        const std::string unit = info_.crs.vertical_unit;
        info_.crs = raster->info().crs;
        if (!unit.empty()) info_.crs.vertical_unit = unit;
      }
    }
    for (const VrtSource& source : sources_) {
      info_.held_bytes += sizeof source + source.file.capacity() + sizeof(std::uint64_t);
    }
    if (!direct_) {
      constexpr std::uint64_t kWindowColumns = 4096;  // most windows are not wider
      info_.held_bytes += std::min(info_.columns, kWindowColumns) * kStripRows *
                          (2 * size_of(info_.sample.type) + 4);
    }
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  void set_open_bytes(std::uint64_t bytes) override { open_bytes_ = bytes; }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    bool any = false;
    const std::size_t bytes = size_of(info_.sample.type);
    if (direct_) {
      for (std::size_t i = 0; i < sources_.size(); ++i) {
        const VrtSource& source = sources_[i];
        const std::optional<Overlap> overlap = overlap_of(source, window);
        if (!overlap) continue;
        const std::size_t target = static_cast<std::size_t>(overlap->row) * out.stride +
                                   static_cast<std::size_t>(overlap->column);
        any |= opened(i).read_over(overlap->inside, {.samples = out.samples + target * bytes,
                                                     .valid = out.valid + target,
                                                     .stride = out.stride});
      }
      return any;
    }
    for (std::uint64_t row = 0; row < window.rows; row += kStripRows) {
      const CellWindow strip{.column = window.column,
                             .row = window.row + row,
                             .columns = window.columns,
                             .rows = std::min(kStripRows, window.rows - row)};
      const std::size_t target = static_cast<std::size_t>(row) * out.stride;
      any |= compose(strip, {.samples = out.samples + target * bytes,
                             .valid = out.valid + target,
                             .stride = out.stride});
    }
    return any;
  }

 private:
  static constexpr std::size_t kOpenAtOnce = 32;
  static constexpr std::uint64_t kStripRows = 256;

  /// The overlap of a source and a window.
  struct Overlap {
    CellWindow inside{};                ///< the overlap in the source
    std::uint64_t column = 0, row = 0;  ///< its first cell in the window
  };
  static std::optional<Overlap> overlap_of(const VrtSource& source, const CellWindow& window) {
    const std::uint64_t l = std::max(window.column, source.column),
                        t = std::max(window.row, source.row),
                        r = std::min(window.column + window.columns,
                                     source.column + source.columns),
                        b = std::min(window.row + window.rows, source.row + source.rows);
    if (l >= r || t >= b) return std::nullopt;
    return Overlap{.inside = {.column = source.source_column + (l - source.column),
                              .row = source.source_row + (t - source.row),
                              .columns = r - l,
                              .rows = b - t},
                   .column = l - window.column,
                   .row = t - window.row};
  }

  struct Open {
    std::size_t source;
    std::unique_ptr<Raster> raster;
  };

  /// Notes a difference: a file's nodata value is nodata here even if the mosaic declares none; in
  /// GDAL it is then a height.
  void note_own_nodata(const VrtSource& source, const RasterInfo& file) {
    if (source.nodata || nodata_.value || !file.nodata || noted_) return;
    noted_ = true;
    std::string value;
    append_number(value, *file.nodata);
    info_.notes.push_back(
        fmt::format("{}: declares no nodata value, so that of {}, {}, is used; GDAL reads such "
                    "cells as heights",
                    info_.files.front(), source.file, value));
  }

  /// nodata: see RasterOptions.
  [[nodiscard]] std::unique_ptr<Raster> open(const VrtSource& source,
                                             const std::optional<std::string>& nodata) const {
    RasterOptions options = options_;
    options.band = source.band;
    options.nodata = nodata;
    std::unique_ptr<Raster> raster = open_member(source.file, options);
    const ScalarType type = info_.sample.type;
    const bool reals = type == ScalarType::f32 || type == ScalarType::f64;
    if (raster->info().format == ascii_grid_format().name && !reals) {
      raster = std::make_unique<WholeNumbers>(std::move(raster), type);
    }
    const RasterInfo& info = raster->info();
    const auto fault = [&](const std::string& cause) {
      return Error(info_.files.front(), cause)
          .at(source.file)
          .remedy("convert it to GeoTIFF: gdal_translate FILE out.tif");
    };
    if (info.sample.type != info_.sample.type) {
      throw fault(fmt::format("its samples are {}, but those of the virtual raster are {}",
                              name_of(info.sample.type), name_of(info_.sample.type)));
    }
    if (source.source_column + source.columns > info.columns ||
        source.source_row + source.rows > info.rows) {
      throw fault(fmt::format("has {} x {} cells, fewer than the virtual raster uses", info.columns,
                              info.rows));
    }
    return raster;
  }

  Raster& opened(std::size_t source) {
    const auto entry =
        std::find_if(open_.begin(), open_.end(), [&](const Open& o) { return o.source == source; });
    if (entry != open_.end()) {
      open_.splice(open_.begin(), open_, entry);
      return *open_.front().raster;
    }
    while (!open_.empty() &&
           (open_.size() >= kOpenAtOnce || held_bytes_ + source_bytes_[source] > open_bytes_)) {
      held_bytes_ -= source_bytes_[open_.back().source];
      open_.pop_back();
    }
    std::optional<std::string> nodata = sources_[source].nodata;
    if (!nodata && nodata_.value) nodata = "";  // nodata_ is applied to all sources
    open_.push_front({source, open(sources_[source], nodata)});
    held_bytes_ += source_bytes_[source];
    return *open_.front().raster;
  }

  /// Sets `mask` to 1 for the samples of a row that are data by the rule, to 0 for others.
  void mask(const std::byte* samples, std::size_t cells, const NodataRule& rule,
            std::vector<std::uint8_t>& mask) {
    mask.assign(cells, 0);
    ignored_.resize(cells * size_of(info_.sample.type));
    overlay_row(info_.sample.type, {.samples = samples, .step = 1, .cells = cells}, rule,
                ignored_.data(), mask.data());
  }

  /// True if the source contributes exactly the cells for which its file has data, unchanged.
  [[nodiscard]] bool is_direct(const VrtSource& source, const RasterInfo& file) const {
    if (source.nodata) {
      const NodataRule rule = NodataRule::parse(*source.nodata, info_.sample.type);
      return !nodata_.value || nodata_.value == rule.value;
    }
    const bool holes =
        file.nodata || info_.sample.type == ScalarType::f32 || info_.sample.type == ScalarType::f64;
    return !holes && !nodata_.value;
  }

  /// Composes all sources, then copies the cells with data to `out`. A source may clear cells of
  /// earlier sources, but not those that the caller already has.
  bool compose(const CellWindow& window, const CellBuffer& out) {
    const std::size_t cells = static_cast<std::size_t>(window.columns * window.rows);
    const std::size_t bytes = size_of(info_.sample.type);
    samples_.resize(cells * bytes);
    valid_.assign(cells, 0);
    for (std::size_t i = 0; i < sources_.size(); ++i) lay(i, window);
    bool any = false;
    for (std::size_t row = 0; row < window.rows; ++row) {
      for (std::size_t column = 0; column < window.columns; ++column) {
        const std::size_t at = row * static_cast<std::size_t>(window.columns) + column;
        if (valid_[at] == 0) continue;
        const std::size_t target = row * out.stride + column;
        std::memcpy(out.samples + target * bytes, samples_.data() + at * bytes, bytes);
        out.valid[target] = 1;
        any = true;
      }
    }
    return any;
  }

  /// Overlays a source on the window, as GDAL composes bands.
  void lay(std::size_t number, const CellWindow& window) {
    const VrtSource& source = sources_[number];
    const std::optional<Overlap> overlap = overlap_of(source, window);
    if (!overlap) return;
    const std::size_t bytes = size_of(info_.sample.type);
    const auto columns = static_cast<std::size_t>(overlap->inside.columns),
               rows = static_cast<std::size_t>(overlap->inside.rows);
    part_.resize(columns * rows * bytes);
    part_valid_.assign(columns * rows, 0);
    opened(number).read_over(
        overlap->inside, {.samples = part_.data(), .valid = part_valid_.data(), .stride = columns});
    for (std::size_t row = 0; row < rows; ++row) {
      const std::byte* const samples = part_.data() + row * columns * bytes;
      const std::uint8_t* const has_data = part_valid_.data() + row * columns;
      mask(samples, columns, nodata_, data_);
      const std::size_t target =
          static_cast<std::size_t>((overlap->row + row) * window.columns + overlap->column);
      for (std::size_t i = 0; i < columns; ++i) {
        if (source.nodata && has_data[i] == 0) continue;
        const bool good = has_data[i] != 0 && data_[i] != 0;
        valid_[target + i] = good ? 1 : 0;
        if (good) std::memcpy(samples_.data() + (target + i) * bytes, samples + i * bytes, bytes);
      }
    }
  }

  RasterOptions options_;
  RasterInfo info_;
  std::vector<VrtSource> sources_;
  NodataRule nodata_;
  std::vector<std::uint64_t> source_bytes_;  ///< bytes, by source
  std::list<Open> open_;                     ///< most recently used first
  std::uint64_t open_bytes_, held_bytes_ = 0;
  bool noted_ = false;  ///< see note_own_nodata()
  bool direct_ = true;  ///< all sources are direct: see is_direct()
  std::vector<std::byte> samples_, part_, ignored_;
  std::vector<std::uint8_t> valid_, part_valid_, data_;
};

std::unique_ptr<Raster> open_vrt(const std::string& file, const RasterOptions& options) {
  return std::make_unique<VrtRaster>(file, options);
}

std::unique_ptr<PointSource> open_vrt_points(std::span<const std::string> files,
                                             const SourceOptions& options) {
  return open_raster_points(files, options, &open_vrt);
}

}  // namespace

const Format& vrt_format() {
  static const Format format{.name = "vrt",
                             .endings = {".vrt"},
                             .recognise = &recognise_vrt,
                             .open = &open_vrt_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
