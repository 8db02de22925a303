// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "format/raster_points.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens a raster and applies GDAL's sidecar FILE.aux.xml, if it exists: the CRS, the
/// georeferencing, and the band's nodata value, scale, offset and unit. As in GDAL, the sidecar
/// overrides a GeoTIFF except for scale and offset, adds only what files of other formats lack, and
/// is ignored for virtual rasters. Notes report differences; a comment reports a sidecar that
/// cannot be read.
std::unique_ptr<Raster> open_with_aux_xml(const OpenRaster& open, const std::string& file,
                                          const RasterOptions& options);

}  // namespace terrace::stream
