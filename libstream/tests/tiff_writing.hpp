// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tiffio.h>

#include "raster_testing.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// How a test writes a TIFF with libtiff itself.
struct TiffSpec {
  std::uint32_t columns = 1, rows = 1, bands = 1;
  ScalarType type = ScalarType::i16;
  std::string mode = "w";  ///< 8: BigTIFF, b: big-endian
  std::uint16_t compression = COMPRESSION_NONE;
  std::uint16_t predictor = 1;
  bool separate = false;
  std::uint32_t tile_columns = 0, tile_rows = 0;  ///< 0: strips
  std::uint32_t rows_per_strip = 0;               ///< 0: all
  std::function<void(TIFF*)> more;                ///< sets further fields
};

inline const std::array<TIFFFieldInfo, 8>& geo_fields() {
  const auto name = [](const char* text) { return const_cast<char*>(text); };
  static const std::array<TIFFFieldInfo, 8> fields{{
      {33550, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelPixelScale")},
      {33922, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelTiepoint")},
      {34264, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelTransformation")},
      {34735, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, name("GeoKeyDirectory")},
      {34736, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("GeoDoubleParams")},
      {34737, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GeoAsciiParams")},
      {42112, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GDAL_METADATA")},
      {42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GDAL_NODATA")},
  }};
  return fields;
}

/// Writes `samples`, native values by rows, bands interleaved by cell.
inline void write_tiff(const std::filesystem::path& path, const TiffSpec& spec,
                       const std::vector<std::byte>& samples) {
  const TIFFErrorHandler handler =
      TIFFSetWarningHandler(nullptr);  // Deflate's old code is intended
  TIFF* tiff = TIFFOpen(path.c_str(), spec.mode.c_str());
  ASSERT_NE(tiff, nullptr) << path;
  TIFFMergeFieldInfo(tiff, geo_fields().data(), static_cast<std::uint32_t>(geo_fields().size()));
  const std::size_t size = size_of(spec.type);
  const bool is_float = spec.type == ScalarType::f32 || spec.type == ScalarType::f64;
  const bool is_signed = spec.type == ScalarType::i8 || spec.type == ScalarType::i16 ||
                         spec.type == ScalarType::i32 || spec.type == ScalarType::i64;
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, spec.columns);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, spec.rows);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, static_cast<int>(spec.bands));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * size));
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_float ? 3 : is_signed ? 2 : 1);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, spec.separate ? 2 : 1);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, static_cast<int>(spec.compression));
  if (spec.predictor != 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, static_cast<int>(spec.predictor));
  const bool tiled = spec.tile_columns != 0;
  const std::uint32_t bc = tiled ? spec.tile_columns : spec.columns;
  std::uint32_t br = tiled ? spec.tile_rows : spec.rows_per_strip;
  if (br == 0) br = spec.rows;
  if (tiled) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, bc);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, br);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, br);
  }
  if (spec.more) spec.more(tiff);
  const std::uint32_t planes = spec.separate ? spec.bands : 1;
  const std::uint32_t side_by_side = spec.separate ? 1 : spec.bands;
  std::uint32_t number = 0;
  for (std::uint32_t plane = 0; plane < planes; ++plane) {
    for (std::uint32_t top = 0; top < spec.rows; top += br) {
      for (std::uint32_t first_column = 0; first_column < spec.columns;
           first_column += bc, ++number) {
        const std::uint32_t rows = tiled ? br : std::min(br, spec.rows - top);
        std::vector<std::byte> block(std::size_t{rows} * bc * side_by_side * size);
        for (std::uint32_t r = 0; r < rows && top + r < spec.rows; ++r) {
          for (std::uint32_t c = 0; c < bc && first_column + c < spec.columns; ++c) {
            const std::size_t cell = std::size_t{top + r} * spec.columns + first_column + c;
            std::memcpy(block.data() + (std::size_t{r} * bc + c) * side_by_side * size,
                        samples.data() + (cell * spec.bands + plane) * size, side_by_side * size);
          }
        }
        const auto bytes = static_cast<tmsize_t>(block.size());
        const tmsize_t written = tiled ? TIFFWriteEncodedTile(tiff, number, block.data(), bytes)
                                       : TIFFWriteEncodedStrip(tiff, number, block.data(), bytes);
        ASSERT_EQ(written, bytes) << path;
      }
    }
  }
  TIFFClose(tiff);
  TIFFSetWarningHandler(handler);
}

/// Sets pixel scale 1 x 1 and a tie point, for a raster at (x, y).
inline std::function<void(TIFF*)> placed_at(double x, double y, double cell = 1.0) {
  return [=](TIFF* tiff) {
    const std::array<double, 3> scale{cell, cell, 0};
    const std::array<double, 6> tie{0, 0, 0, x, y, 0};
    TIFFSetField(tiff, 33550, 3, scale.data());
    TIFFSetField(tiff, 33922, 6, tie.data());
  };
}

/// `values` as native samples of type T.
template <class T>
std::vector<std::byte> as_samples(const std::vector<T>& values) {
  std::vector<std::byte> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

}  // namespace terrace::stream
