// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "raster/nodata.hpp"
#include "terrace/stream/raster.hpp"

/// GDAL's virtual rasters (VRT), as far as they are mosaics: the cells of their files must coincide
/// with the cells of the mosaic, to within kNearestCell. Elements that would compute samples
/// (resampling, scaling, masks, pixel functions, warping) are refused by name.

namespace terrace::stream {

/// A source of the band, and the destination of its cells.
struct VrtSource {
  std::string file{};
  int band = 1;
  /// The source's nodata value, which overrides that of its file. Without it the source replaces
  /// the cells below it, whether it has data or not.
  std::optional<std::string> nodata{};
  std::uint64_t source_column = 0, source_row = 0;  ///< first cell of the part of the source
  std::uint64_t column = 0, row = 0, columns = 0, rows = 0;
};

/// One band of a virtual raster.
struct VrtDocument {
  RasterInfo info{};
  std::vector<VrtSource> sources{};  ///< in order of precedence, topmost last
  NodataRule nodata{};               ///< nodata value of the mosaic
};

/// The CRS of an SRS element: a code ("EPSG:n", "EPSG:n+m"), or else the text as WKT.
Crs crs_of_srs(std::string_view text);

/// Reads the description; its sources are not opened. band: counted from 1. Throws: Error if it is
/// not a VRT or not supported.
VrtDocument read_vrt(const std::string& file, int band);

}  // namespace terrace::stream
