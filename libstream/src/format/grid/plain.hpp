// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "raster/nodata.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A raster with rows of equal length as plain bytes: the form of most elevation grids, possibly
/// after decompression.
struct PlainGrid {
  RasterInfo info{};
  NodataRule nodata{};
  std::endian order = std::endian::native;
  std::uint64_t first = 0;        ///< offset of the first sample
  std::uint64_t row_bytes = 0;    ///< from one row to the next
  std::uint64_t sample_step = 1;  ///< samples from one column to the next (interleaved bands)
};

/// The remedy for a damaged file.
inline constexpr const char* kDownloadRemedy =
    "the file is damaged or truncated: download it again";
/// Maximum expansion factor of Deflate.
inline constexpr std::uint64_t kDeflateGrowth = 1032;

/// Returns an Error with the remedy kDownloadRemedy.
Error grid_fault(std::string file, std::string cause);

/// Describes a grid of one file: format, name, size, sample type and nodata (as the file's text).
/// Rows are contiguous. Throws: Error if it has no cells, or 2^30 or more columns or rows.
PlainGrid plain_grid(std::string format, const std::string& file, std::uint64_t columns,
                     std::uint64_t rows, ScalarType type, const std::string& nodata = {});

/// Sets the nodata value from a file's text; empty for none.
void set_nodata(const std::string& text, PlainGrid& grid);

/// Throws: Error if there is no band with that number, counted from 1.
void check_band(const std::string& file, int band, std::uint64_t bands);

/// Opens the raster in `bytes`. Throws: Error if they end before the last sample does.
std::unique_ptr<Raster> open_plain_grid(PlainGrid grid, std::unique_ptr<ByteSource> bytes);

/// Like open_plain_grid(), with bytes that `unpack` produces when the first window is read: a
/// raster of a mosaic is opened first for its placement, and again for its samples.
/// grid.info.held_bytes: the memory that unpacking takes.
std::unique_ptr<Raster> open_packed_grid(PlainGrid grid,
                                         std::function<std::unique_ptr<ByteSource>()> unpack);

}  // namespace terrace::stream
