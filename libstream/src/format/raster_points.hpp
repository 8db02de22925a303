// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens one file of a raster format.
using OpenRaster =
    std::function<std::unique_ptr<Raster>(const std::string& file, const RasterOptions& options)>;

/// Implements Format::open for rasters: the cells of one file, or of a mosaic of several, as
/// points.
std::unique_ptr<PointSource> open_raster_points(std::span<const std::string> files,
                                                const SourceOptions& options,
                                                const OpenRaster& open);

}  // namespace terrace::stream
