// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "format/raster_points.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens a raster and applies what GDAL keeps next to it in FILE.aux.xml: CRS, place, and of the
/// band nodata value, scale, offset and unit. As in GDAL, the sidecar overrides a GeoTIFF, except
/// for scale and offset; to files of other formats it adds what they lack, and virtual rasters have
/// none. Notes name what differs. A comment reports a sidecar that cannot be read.
std::unique_ptr<Raster> open_with_aux_xml(const OpenRaster& open, const std::string& file,
                                          const RasterOptions& options);

}  // namespace terrace::stream
