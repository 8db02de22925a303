// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// The raster of a file with what the file lacks and GDAL keeps beside it, in FILE.aux.xml: CRS,
/// place, and of the band nodata value, scale, offset and unit. A sidecar that cannot be read is
/// told of in a comment.
std::unique_ptr<Raster> with_aux_xml(std::unique_ptr<Raster> raster, const std::string& file,
                                     const RasterOptions& options);

}  // namespace terrace::stream
