// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "format/geotiff/blocks.hpp"
#include "format/geotiff/georeference.hpp"
#include "format/geotiff/handle.hpp"
#include "format/geotiff/keys.hpp"
#include "format/geotiff/layout.hpp"
#include "format/geotiff/tags.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "raster/nodata.hpp"

namespace terrace::stream {
namespace {

/// The transparency mask of a raster, in the same file or next to it (FILE.msk, as GDAL writes it):
/// cells where it is 0 have no data.
class GeoTiffMask {
 public:
  /// Returns the mask of the raster, or null if it has none.
  static std::unique_ptr<GeoTiffMask> find(const GeoTiffHandle& raster, const GeoTiffLayout& layout,
                                           const RasterOptions& options) {
    const auto open = [&options](const std::string& file) {
      return std::make_unique<GeoTiffHandle>(file, options.memory_bytes);
    };
    std::unique_ptr<GeoTiffHandle> handle;
    std::uint32_t band = 0;
    std::error_code ignored;
    if (TIFFLastDirectory(raster.tiff()) == 0) {
      handle = open(raster.file());
      if (!handle->go_to_mask()) handle.reset();
    }
    const std::string mask_file = raster.file() + ".msk";
    if (handle == nullptr && std::filesystem::is_regular_file(mask_file, ignored)) {
      handle = open(mask_file);
      if (handle->value_or<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1) > layout.band) {
        band = layout.band;
      }
    }
    if (handle == nullptr) return nullptr;
    std::unique_ptr<GeoTiffMask> mask(new GeoTiffMask(std::move(handle), band, options));
    if (mask->layout_.columns != layout.columns || mask->layout_.rows != layout.rows) {
      throw mask->handle_->fault("is not as large as its raster")
          .at("mask")
          .remedy("export both again: gdal_translate");
    }
    return mask;
  }

  GeoTiffBlocks& blocks() { return blocks_; }

 private:
  GeoTiffMask(std::unique_ptr<GeoTiffHandle> handle, std::uint32_t band,
              const RasterOptions& options)
      : handle_(std::move(handle)),
        layout_(geotiff_layout(*handle_, static_cast<int>(band) + 1)),
        blocks_(*handle_, layout_, NodataRule::parse("0", layout_.type), options.memory_bytes,
                options.cache_bytes) {}

  std::unique_ptr<GeoTiffHandle> handle_;
  GeoTiffLayout layout_;
  GeoTiffBlocks blocks_;
};

/// One band of a GeoTIFF.
class GeoTiffRaster final : public Raster {
 public:
  GeoTiffRaster(const std::string& file, const RasterOptions& options)
      : handle_(file, options.memory_bytes),
        layout_(geotiff_layout(handle_, options.band)),
        nodata_text_(options.nodata.value_or(handle_.text(kGdalNodata))),
        nodata_(NodataRule::parse(nodata_text_, layout_.type)),
        blocks_(handle_, layout_, nodata_, options.memory_bytes, options.cache_bytes),
        mask_(GeoTiffMask::find(handle_, layout_, options)) {
    if (mask_ != nullptr) blocks_.set_mask(mask_->blocks());
    describe();
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    return blocks_.read_over(window, out);
  }

 private:
  void describe() {
    info_.format = "geotiff";
    info_.files = {handle_.file()};
    info_.columns = layout_.columns;
    info_.rows = layout_.rows;
    info_.block_columns = std::min(layout_.block_columns, layout_.columns);
    info_.block_rows = std::min(layout_.block_rows, layout_.rows);
    info_.held_bytes = blocks_.held_bytes() + (mask_ ? mask_->blocks().held_bytes() : 0);
    const GeoKeys keys(handle_.shorts(kGeoKeyDirectory), handle_.doubles(kGeoDoubleParams),
                       handle_.text(kGeoAsciiParams));
    info_.crs = crs_of(keys);
    place_geotiff(handle_, keys, info_);
    info_.nodata = nodata_.value;
    describe_sample();
    std::uint16_t extra = 0;
    const std::uint16_t* kinds = nullptr;
    if (TIFFGetField(handle_.tiff(), TIFFTAG_EXTRASAMPLES, &extra, &kinds) == 1 && extra > 0 &&
        kinds[extra - 1] != EXTRASAMPLE_UNSPECIFIED) {
      info_.comments.push_back(
          fmt::format("band {} is alpha, which is ignored; if it marks cells without data, write a "
                      "nodata value: gdalwarp -dstnodata",
                      layout_.bands));
    }
    if (nodata_.unmatched) {
      info_.comments.push_back(
          fmt::format("nodata {} is not a value of type {}", nodata_text_, name_of(layout_.type)));
    }
    info_.comments.insert(info_.comments.end(), keys.faults().begin(), keys.faults().end());
    info_.comments.insert(info_.comments.end(), handle_.warnings().begin(),
                          handle_.warnings().end());
  }

  void describe_sample() {
    const BandMetadata band = band_metadata(handle_.text(kGdalMetadata), layout_.band);
    info_.sample.name = "height";
    info_.sample.type = layout_.type;
    info_.sample.scale = band.scale.value_or(1.0);
    info_.sample.offset = band.offset.value_or(0.0);
    info_.sample.unit = band.unit.empty() ? info_.crs.vertical_unit : band.unit;
    if (info_.crs.vertical_unit.empty()) info_.crs.vertical_unit = info_.sample.unit;
    if (info_.sample.scale == 0 || !std::isfinite(info_.sample.scale) ||
        !std::isfinite(info_.sample.offset)) {
      throw handle_.fault("scale or offset of the band is zero or not finite")
          .at("GDAL_METADATA")
          .remedy("set them again (gdal_edit.py -scale -offset)");
    }
  }

  GeoTiffHandle handle_;
  GeoTiffLayout layout_;
  std::string nodata_text_;
  NodataRule nodata_;
  GeoTiffBlocks blocks_;
  std::unique_ptr<GeoTiffMask> mask_;
  RasterInfo info_;
};

bool looks_like_tiff(std::span<const std::byte> head) {
  if (head.size() < 4) return false;
  static constexpr std::array<const char*, 4> kMagic{"II*\0", "MM\0*", "II+\0", "MM\0+"};
  return std::any_of(kMagic.begin(), kMagic.end(),
                     [&](const char* magic) { return std::memcmp(head.data(), magic, 4) == 0; });
}

std::unique_ptr<PointSource> open_points(std::span<const std::string> files,
                                         const SourceOptions& options) {
  return open_raster_points(files, options, &open_geotiff);
}

}  // namespace

std::unique_ptr<Raster> open_geotiff(const std::string& file, const RasterOptions& options) {
  return std::make_unique<GeoTiffRaster>(file, options);
}

const Format& geotiff_format() {
  static const Format format{.name = "geotiff",
                             .endings = {".tif", ".tiff", ".gtiff", ".btf", ".tf8"},
                             .self_contained = true,
                             .recognise = looks_like_tiff,
                             .open = open_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
