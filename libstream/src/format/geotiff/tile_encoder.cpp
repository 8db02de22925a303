// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/tile_encoder.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <new>
#include <string>
#include <type_traits>

#include <libdeflate.h>
#include <zstd.h>

#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

/// Predictor 2 of GDAL and libtiff: each sample minus the one to its left.
template <class T>
void difference_row(std::byte* row, std::size_t columns) {
  using Bits = std::make_unsigned_t<T>;
  Bits left = 0;
  for (std::size_t i = 0; i < columns; ++i) {
    Bits value;
    std::memcpy(&value, row + i * sizeof value, sizeof value);
    const auto less = static_cast<Bits>(value - left);
    std::memcpy(row + i * sizeof less, &less, sizeof less);
    left = value;
  }
}

/// Predictor 3 (Adobe Photoshop TIFF Technical Note 3): the most significant bytes of all samples,
/// then the next ones, and so on; each byte minus the previous one.
void difference_floats(std::byte* row, std::size_t columns, std::size_t size,
                       std::vector<std::byte>& scratch) {
  scratch.assign(row, row + columns * size);
  for (std::size_t byte = 0; byte < size; ++byte) {
    const std::size_t from = std::endian::native == std::endian::little ? size - 1 - byte : byte;
    for (std::size_t i = 0; i < columns; ++i) row[byte * columns + i] = scratch[i * size + from];
  }
  for (std::size_t i = columns * size; i-- > 1;) {
    row[i] = static_cast<std::byte>(std::to_integer<unsigned>(row[i]) -
                                    std::to_integer<unsigned>(row[i - 1]));
  }
}

}  // namespace

TileEncoder::TileEncoder(const GeoTiffOptions& options) : options_(options) {
  if (options_.compression == GeoTiffCompression::deflate) {
    deflate_ = libdeflate_alloc_compressor(std::clamp(options_.level, 1, 12));
    if (deflate_ == nullptr) throw std::bad_alloc();
  }
}

TileEncoder::~TileEncoder() { libdeflate_free_compressor(deflate_); }

void TileEncoder::difference(std::span<std::byte> samples) {
  const std::size_t size = size_of(options_.sample.type);
  for (std::size_t at = 0; at < samples.size(); at += options_.tile * size) {
    with_type(options_.sample.type, [&](auto sample) {
      using T = decltype(sample);
      if constexpr (std::is_integral_v<T>) {
        difference_row<T>(samples.data() + at, options_.tile);
      } else {
        difference_floats(samples.data() + at, options_.tile, sizeof(T), row_);
      }
    });
  }
}

std::span<const std::byte> TileEncoder::encode(std::span<std::byte> samples) {
  if (options_.compression == GeoTiffCompression::none) return samples;
  if (options_.predictor) difference(samples);
  std::size_t bytes = 0;
  if (options_.compression == GeoTiffCompression::deflate) {
    coded_.resize(libdeflate_zlib_compress_bound(deflate_, samples.size()));
    bytes = libdeflate_zlib_compress(deflate_, samples.data(), samples.size(), coded_.data(),
                                     coded_.size());
    assert(bytes > 0);
  } else {
    coded_.resize(ZSTD_compressBound(samples.size()));
    bytes =
        ZSTD_compress(coded_.data(), coded_.size(), samples.data(), samples.size(), options_.level);
    if (ZSTD_isError(bytes) != 0) throw std::bad_alloc();
  }
  return std::span(coded_).first(bytes);
}

}  // namespace terrace::stream
