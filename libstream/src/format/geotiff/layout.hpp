// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "format/geotiff/handle.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The layout of the samples of one band in a TIFF file. A *block* is a tile or a strip.
struct GeoTiffLayout {
  std::uint32_t columns = 0, rows = 0;
  std::uint32_t bands = 1, band = 0;  ///< band counted from 0
  bool tiled = false;
  bool separate = false;  ///< each band has its own blocks
  std::uint32_t block_columns = 0, block_rows = 0;
  std::uint32_t blocks_across = 0, blocks_down = 0;
  std::uint16_t compression = 1;
  std::uint16_t sample_format = 1;
  unsigned bits = 8;                 ///< bits of a stored sample
  ScalarType type = ScalarType::u8;  ///< type of a sample in memory
  bool plain = false;                ///< uncompressed whole bytes: readable without libtiff
  bool swapped = false;              ///< the byte order is not native

  /// Interleaved samples per pixel in a block.
  [[nodiscard]] std::uint32_t samples_per_pixel() const { return separate ? 1 : bands; }
  /// Stored bytes of a row of a block.
  [[nodiscard]] std::uint64_t row_bytes() const {
    return (std::uint64_t{block_columns} * samples_per_pixel() * bits + 7) / 8;
  }
  /// Rows of the block at `down` that are rows of the raster: the last block may extend beyond it.
  [[nodiscard]] std::uint32_t rows_in_image(std::uint32_t down) const {
    return std::min(block_rows, rows - down * block_rows);
  }
  /// Returns the index of a block in the file's tables.
  [[nodiscard]] std::uint32_t block(std::uint32_t across, std::uint32_t down) const {
    return (separate ? band * blocks_across * blocks_down : 0) + down * blocks_across + across;
  }
  /// "tile 3,4" (across, down) or "strip 7": for messages.
  [[nodiscard]] std::string block_name(std::uint32_t across, std::uint32_t down) const;
};

/// Reads and checks the layout of the handle's directory. `band` is counted from 1. Throws: Error
/// for invalid or unsupported layouts.
GeoTiffLayout geotiff_layout(const GeoTiffHandle& handle, int band);

/// How `unpack_samples` reads samples that are not a native type.
struct PackedSamples {
  std::uint16_t sample_format = 1;  ///< as in the TIFF
  unsigned bits = 8;
  ScalarType type = ScalarType::u8;  ///< the type to produce
};

/// True if libtiff already delivers the samples as native values of `packed.type`.
bool is_native(const PackedSamples& packed);

/// Widens `count` packed samples to native values. The first is sample number `first` of the row
/// `bytes`, each further one `step` samples later. Integers of odd widths are packed from the
/// highest bit on, as in GDAL. That includes 24 bits, although libtiff swaps their bytes in files
/// of the other byte order. Floats of 16 and 24 bits are in native byte order.
void unpack_samples(const PackedSamples& packed, const std::byte* bytes, std::size_t first,
                    std::size_t step, std::size_t count, std::byte* out);

/// Returns the exact value of a float of 16 bits (IEEE) or 24 bits (1 sign, 7 exponent, 16
/// mantissa).
float float_from_16(std::uint16_t bits);
float float_from_24(std::uint32_t bits);

}  // namespace terrace::stream
