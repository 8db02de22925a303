// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/layout.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

#include <fmt/core.h>
#include <tiff.h>

#include "io/text.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint32_t kMaxCells = 1u << 30;  // later code has 30-bit columns and rows

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

/// Returns the type in memory of a stored sample; nullopt if it is not supported.
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
    throw handle.fault("has no columns or rows").remedy("check the file (tiffinfo)");
  }
  layout.columns = *columns;
  layout.rows = *rows;
  if (layout.columns >= kMaxCells || layout.rows >= kMaxCells) {
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

/// Converts small floats to single precision, which has every value; subnormals become normal.
template <unsigned kExponentBits, unsigned kMantissaBits>
float widen(std::uint32_t bits) {
  constexpr std::uint32_t kMantissaMask = (1u << kMantissaBits) - 1;
  constexpr std::uint32_t kExponentMask = (1u << kExponentBits) - 1;
  constexpr std::uint32_t kBias = kExponentMask >> 1;
  const std::uint32_t sign = (bits >> (kExponentBits + kMantissaBits)) << 31;
  std::uint32_t exponent = (bits >> kMantissaBits) & kExponentMask;
  std::uint32_t mantissa = bits & kMantissaMask;
  if (exponent == kExponentMask) {  // infinity, NaN
    return std::bit_cast<float>(sign | 0x7f800000u | (mantissa << (23 - kMantissaBits)));
  }
  if (exponent == 0) {
    if (mantissa == 0) return std::bit_cast<float>(sign);
    exponent = 1;
    while ((mantissa >> kMantissaBits) == 0) {
      mantissa <<= 1;
      --exponent;  // may wrap around below zero; the sum below is right modulo 2^32
    }
    mantissa &= kMantissaMask;
  }
  return std::bit_cast<float>(sign | ((exponent + 127 - kBias) << 23) |
                              (mantissa << (23 - kMantissaBits)));
}

std::uint32_t native_24(const std::byte* bytes) {
  const auto byte = [&](int i) { return std::to_integer<std::uint32_t>(bytes[i]); };
  if constexpr (std::endian::native == std::endian::little) {
    return byte(0) | byte(1) << 8 | byte(2) << 16;
  } else {
    return byte(2) | byte(1) << 8 | byte(0) << 16;
  }
}

/// `bits` bits beginning at bit `position`, counted from the highest bit of the first byte.
std::uint32_t bits_at(const std::byte* bytes, std::uint64_t position, unsigned bits) {
  std::uint64_t value = 0;
  const std::uint64_t first = position / 8, last = (position + bits - 1) / 8;
  for (std::uint64_t i = first; i <= last; ++i) {
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  }
  const std::uint64_t below = 8 * (last + 1) - (position + bits);
  return static_cast<std::uint32_t>((value >> below) & ((std::uint64_t{1} << bits) - 1));
}

}  // namespace

std::string GeoTiffLayout::block_name(std::uint32_t across, std::uint32_t down) const {
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

float float_from_16(std::uint16_t bits) { return widen<5, 10>(bits); }
float float_from_24(std::uint32_t bits) { return widen<7, 16>(bits); }

bool is_native(const PackedSamples& packed) { return packed.bits == 8 * size_of(packed.type); }

void unpack_samples(const PackedSamples& packed, const std::byte* bytes, std::size_t first,
                    std::size_t step, std::size_t count, std::byte* out) {
  const bool is_float = packed.sample_format == SAMPLEFORMAT_IEEEFP;
  with_type(packed.type, [&](auto sample) {
    using T = decltype(sample);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t number = first + i * step;
      T value{};
      if (is_float && packed.bits == 16) {
        std::uint16_t half = 0;
        std::memcpy(&half, bytes + 2 * number, sizeof half);
        value = static_cast<T>(float_from_16(half));
      } else if (is_float) {
        value = static_cast<T>(float_from_24(native_24(bytes + 3 * number)));
      } else {
        const std::uint32_t raw = bits_at(bytes, std::uint64_t{number} * packed.bits, packed.bits);
        if (packed.sample_format == SAMPLEFORMAT_INT) {  // the highest bit is the sign
          const unsigned unused = 32 - packed.bits;
          value = static_cast<T>(static_cast<std::int32_t>(raw << unused) >> unused);
        } else {
          value = static_cast<T>(raw);
        }
      }
      std::memcpy(out + i * sizeof(T), &value, sizeof(T));
    }
  });
}

}  // namespace terrace::stream
