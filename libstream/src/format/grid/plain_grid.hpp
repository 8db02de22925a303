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
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A raster whose samples stand in rows of equal length, as plain bytes: what most formats of
/// elevation grids are, or become when they are unpacked.
struct PlainGrid {
  RasterInfo info{};
  NodataRule nodata{};
  std::endian order = std::endian::native;
  std::uint64_t first = 0;        ///< byte where the first sample begins
  std::uint64_t row_bytes = 0;    ///< from one row to the next
  std::uint64_t sample_step = 1;  ///< samples from one column to the next (bands side by side)
};

/// The remedy for what is not as it was made.
inline constexpr const char* kFetchAgain = "fetch the file again; it is damaged or cut short";
/// Deflate makes at most so many bytes of one.
inline constexpr std::uint64_t kDeflateGrowth = 1032;

/// Throws: Error, always.
[[noreturn]] void refuse_grid(const std::string& file, std::string where, std::string cause,
                              std::string remedy = kFetchAgain);

/// Describes a grid of one file: format, name, size, sample type and nodata (as the file's text).
/// Rows follow one another without gaps. Throws: Error if it has no cell, or 2^30 columns or rows.
PlainGrid plain_grid(std::string format, const std::string& file, std::uint64_t columns,
                     std::uint64_t rows, ScalarType type, const std::string& nodata = {});

/// Throws: Error if there is no band of that number, counted from 1.
void check_band(const std::string& file, int band, std::uint64_t bands);

/// The raster over its bytes. Throws: Error if they end before the last sample does.
std::unique_ptr<Raster> open_plain_grid(PlainGrid grid, std::unique_ptr<ByteSource> bytes);

/// The same with bytes that `unpack` makes when the first window is read. A raster of a mosaic is
/// opened for its place first, and again for its samples. RasterInfo::held_bytes of `grid` is what
/// unpacking takes.
std::unique_ptr<Raster> open_packed_grid(PlainGrid grid,
                                         std::function<std::unique_ptr<ByteSource>()> unpack);

}  // namespace terrace::stream
