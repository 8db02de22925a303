// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/geotiff/handle.hpp"
#include "format/geotiff/keys.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Sets the transform from column and row to the sample's position: from pixel scale and tie point,
/// else from the matrix, else from a world file. Adds a comment on what it had to interpret, and a
/// note if a world file differs. `info` must have the size already. Throws: Error for values that
/// are not finite, for a degenerate matrix, and if there are only ground control points.
void place_geotiff(const GeoTiffHandle& handle, const GeoKeys& keys, RasterInfo& info);

/// The contents of GDAL_METADATA for one band, counted from 0.
struct BandMetadata {
  std::optional<double> scale, offset;
  std::string unit;
};
BandMetadata band_metadata(const std::string& xml, unsigned band);

}  // namespace terrace::stream
