// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "terrace/stream/raster.hpp"
#include "terrace/stream/source.hpp"

/// Sources that read points or samples from a program's arrays. Only the block that is being
/// delivered is copied; the arrays must outlive the source.

namespace terrace::stream {

/// Equally spaced numbers in memory, in native byte order and possibly unaligned.
struct MemoryColumn {
  const std::byte* first = nullptr;
  std::ptrdiff_t stride = 0;  ///< bytes from one number to the next; may be negative
};

/// Points in columns.
struct MemoryPoints {
  /// Types, scales and names of coordinates and attributes, the CRS, and in `files` a name for
  /// messages. open_memory() sets `points`.
  SourceInfo info;
  std::uint64_t count = 0;
  std::array<MemoryColumn, 3> coordinates;  ///< of the types in info.coordinates
  std::vector<MemoryColumn> attributes;     ///< of the types in info.attributes
};

/// The samples of a raster.
struct MemoryRaster {
  /// Size, sample type, placement, CRS, nodata, and in `files` a name for messages.
  RasterInfo info;
  const std::byte* first = nullptr;                  ///< the sample of column 0, row 0
  std::ptrdiff_t column_stride = 0, row_stride = 0;  ///< bytes
};

/// Opens the points, in their order. Of the options, only block_points, crs, selection and those of
/// reading ahead have an effect. Points with a NaN coordinate are left out and counted as nodata.
/// Throws: Error for a selection that does not apply; std::invalid_argument unless each attribute
/// has a column. next() throws Error for an infinite coordinate, naming the point.
std::unique_ptr<PointSource> open_memory(MemoryPoints points, const SourceOptions& options = {});

/// Opens the samples as points, as points_of() does. Samples that equal info.nodata, NaN and the
/// infinities have no data.
std::unique_ptr<PointSource> open_memory(const MemoryRaster& raster,
                                         const SourceOptions& options = {});

}  // namespace terrace::stream
