// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/layout.hpp"

#include <algorithm>
#include <optional>

#include <fmt/core.h>

#include "io/text.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint32_t kMostCells = 1u << 30;  // later code has 30-bit columns and rows

const char* name_of_codec(std::uint16_t compression) {
  switch (compression) {
    case COMPRESSION_LZW:
      return "LZW";
    case COMPRESSION_OJPEG:
      return "old-style JPEG";
    case COMPRESSION_JPEG:
      return "JPEG";
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
      return "Deflate";
    case COMPRESSION_LZMA:
      return "LZMA";
    case COMPRESSION_LERC:
      return "LERC";
    case COMPRESSION_ZSTD:
      return "ZSTD";
    case COMPRESSION_WEBP:
      return "WebP";
    case COMPRESSION_JXL:
      return "JPEG XL";
    case COMPRESSION_SGILOG:
    case COMPRESSION_SGILOG24:
      return "SGI LogLuv";
    default:
      return "unknown codec";
  }
}

/// The type in memory of a stored sample; nullopt if it is not supported.
std::optional<ScalarType> type_in_memory(std::uint16_t format, unsigned bits) {
  if (format == SAMPLEFORMAT_IEEEFP) {
    if (bits == 16 || bits == 24 || bits == 32) return ScalarType::f32;
    if (bits == 64) return ScalarType::f64;
    return std::nullopt;
  }
  const bool is_signed = format == SAMPLEFORMAT_INT;
  if (!is_signed && format != SAMPLEFORMAT_UINT && format != SAMPLEFORMAT_VOID) return std::nullopt;
  if (bits == 0 || (bits > 32 && bits != 64)) return std::nullopt;
  if (bits <= 8) return is_signed ? ScalarType::i8 : ScalarType::u8;
  if (bits <= 16) return is_signed ? ScalarType::i16 : ScalarType::u16;
  if (bits <= 32) return is_signed ? ScalarType::i32 : ScalarType::u32;
  return is_signed ? ScalarType::i64 : ScalarType::u64;
}

void check_codec(const GeoTiffHandle& handle, const GeoTiffLayout& layout) {
  const std::string name =
      fmt::format("{} ({})", name_of_codec(layout.compression), layout.compression);
  const char* remedy = "convert it: gdal_translate -co COMPRESS=DEFLATE -co TILED=YES";
  if (TIFFIsCODECConfigured(layout.compression) == 0) {
    throw handle.fault("compression " + name + " is not in this system's libtiff").remedy(remedy);
  }
  switch (layout.compression) {
    case COMPRESSION_OJPEG:
    case COMPRESSION_SGILOG:
    case COMPRESSION_SGILOG24:
      throw handle.fault("compression " + name + " is not supported").remedy(remedy);
    default:
      break;
  }
  const auto photometric = handle.value_or<std::uint16_t>(TIFFTAG_PHOTOMETRIC, 1);
  if (photometric == PHOTOMETRIC_YCBCR) {
    if (layout.compression != COMPRESSION_JPEG || layout.separate) {
      throw handle.fault("YCbCr colours are not supported").remedy(remedy);
    }
    TIFFSetField(handle.tiff(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  }
}

void read_size(const GeoTiffHandle& handle, GeoTiffLayout& layout) {
  const auto columns = handle.value<std::uint32_t>(TIFFTAG_IMAGEWIDTH);
  const auto rows = handle.value<std::uint32_t>(TIFFTAG_IMAGELENGTH);
  if (!columns || !rows || *columns == 0 || *rows == 0) {
    throw handle.fault("has no size").remedy("check the file (tiffinfo)");
  }
  layout.columns = *columns;
  layout.rows = *rows;
  if (layout.columns >= kMostCells || layout.rows >= kMostCells) {
    throw handle
        .fault(fmt::format("{} x {} cells: columns and rows must each be fewer than 2^30",
                           layout.columns, layout.rows))
        .remedy("split it (gdal_translate -srcwin)");
  }
  if (handle.value_or<std::uint32_t>(TIFFTAG_IMAGEDEPTH, 1) > 1) {
    throw handle.fault("is a volume (ImageDepth), not a raster");
  }
}

void read_sample(const GeoTiffHandle& handle, GeoTiffLayout& layout, int band) {
  layout.bands = handle.value_or<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
  if (layout.bands == 0) throw handle.fault("has no bands").remedy("check the file (tiffinfo)");
  if (band < 1 || static_cast<std::uint32_t>(band) > layout.bands) {
    throw handle.fault(fmt::format("has no band {}, only {}", band, layout.bands))
        .remedy("choose another band");
  }
  layout.band = static_cast<std::uint32_t>(band - 1);
  layout.separate = layout.bands > 1 && handle.value_or<std::uint16_t>(TIFFTAG_PLANARCONFIG, 1) ==
                                            PLANARCONFIG_SEPARATE;
  layout.bits = handle.value_or<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
  layout.sample_format = handle.value_or<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const auto type = type_in_memory(layout.sample_format, layout.bits);
  if (!type) {
    static const char* const kFormats[] = {
        "",          "unsigned integer", "signed integer", "float",
        "undefined", "complex integer",  "complex float"};
    const std::string format = layout.sample_format < std::size(kFormats)
                                   ? kFormats[layout.sample_format]
                                   : fmt::format("SampleFormat {}", layout.sample_format);
    throw handle.fault(fmt::format("{}-bit {} samples are not supported", layout.bits, format))
        .remedy("convert it: gdal_translate -ot Float32");
  }
  layout.type = *type;
}

void read_blocks(const GeoTiffHandle& handle, GeoTiffLayout& layout) {
  layout.tiled = TIFFIsTiled(handle.tiff()) != 0;
  if (layout.tiled) {
    layout.block_columns = handle.value_or<std::uint32_t>(TIFFTAG_TILEWIDTH, 0);
    layout.block_rows = handle.value_or<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
  } else {
    layout.block_columns = layout.columns;
    layout.block_rows =
        std::min(handle.value_or<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, layout.rows), layout.rows);
  }
  const char* const what = layout.tiled ? "tile" : "strip";
  if (layout.block_columns == 0 || layout.block_rows == 0 ||
      layout.block_columns > (1u << 31) - 1 || layout.block_rows > (1u << 31) - 1) {
    throw handle
        .fault(
            fmt::format("invalid {} size {} x {}", what, layout.block_columns, layout.block_rows))
        .remedy("check the file (tiffinfo)");
  }
  layout.blocks_across = (layout.columns + layout.block_columns - 1) / layout.block_columns;
  layout.blocks_down = (layout.rows + layout.block_rows - 1) / layout.block_rows;
  const std::uint64_t planes = layout.separate ? layout.bands : 1;
  const std::uint64_t across = layout.blocks_across, down = layout.blocks_down;
  // Each block has at least one byte in the file's tables of offsets and sizes. Both factors are
  // below 2^30, so their product fits 64 bits; it is checked against the file before multiplying by
  // `planes`, which is below 2^16.
  if (across * down > handle.file_bytes() || across * down * planes > handle.file_bytes() ||
      across * down * planes > UINT32_MAX) {
    throw handle
        .fault(fmt::format("claims {} x {} {}s, more than a file of {} can list", across, down,
                           what, counted(handle.file_bytes(), "byte")))
        .remedy("the file is damaged or truncated: download it again");
  }
}

}  // namespace

std::string GeoTiffLayout::place(std::uint32_t across, std::uint32_t down) const {
  if (tiled) return fmt::format("tile {},{}", across, down);
  return fmt::format("strip {}", down);
}

GeoTiffLayout geotiff_layout(const GeoTiffHandle& handle, int band) {
  GeoTiffLayout layout;
  read_size(handle, layout);
  read_sample(handle, layout, band);
  layout.compression = handle.value_or<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  check_codec(handle, layout);
  read_blocks(handle, layout);
  layout.swapped = TIFFIsByteSwapped(handle.tiff()) != 0;
  layout.plain =
      layout.compression == COMPRESSION_NONE && layout.bits == 8 * size_of(layout.type) &&
      handle.value_or<std::uint16_t>(TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) == FILLORDER_MSB2LSB;
  return layout;
}

}  // namespace terrace::stream
