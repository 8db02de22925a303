// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens a PNG of 8 or 16 bits whose grey values are heights, or whose colours encode heights as
/// set in the options. A world file (.pgw, .pngw or .wld) georeferences it; without one it is a
/// plain grid of unit cells. Pixels with a transparent colour have no data. Throws: Error.
std::unique_ptr<Raster> open_height_map(const std::string& file, const RasterOptions& options = {});

}  // namespace terrace::stream
