// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "terrace/stream/raster.hpp"
#include "terrace/stream/source.hpp"

/// Sources whose points or samples are already in memory: the arrays of a program. Nothing is
/// copied but the block that is being delivered; the arrays must outlive the source.

namespace terrace::stream {

/// Numbers at equal distances in memory, native and possibly unaligned. Either direction.
struct MemoryColumn {
  const std::byte* first = nullptr;
  std::ptrdiff_t stride = 0;  ///< bytes from one number to the next
};

/// Points in columns.
struct MemoryPoints {
  /// Types, scales and names of coordinates and attributes, the CRS, and in `files` a name for
  /// messages. `points` is set here.
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

/// The points in their order. options: block_points, crs, selection and reading ahead count.
/// Those of which a coordinate is NaN are left out and counted as nodata.
/// Throws: Error for a selection that does not suit; in next() for an infinite coordinate, naming
/// the point; std::invalid_argument unless each attribute has a column.
std::unique_ptr<PointSource> open_memory(MemoryPoints points, const SourceOptions& options = {});

/// The samples as points, as from points_of(). Samples without data are those that equal
/// info.nodata, NaN and the infinities.
std::unique_ptr<PointSource> open_memory(const MemoryRaster& raster,
                                         const SourceOptions& options = {});

}  // namespace terrace::stream
