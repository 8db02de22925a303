// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A PNG whose grey values are heights, of 8 or 16 bits, or whose colours are, if the options say
/// how. A world file beside it (.pgw, .pngw or .wld) tells its place; without one it is a plain
/// grid of unit cells. A transparent colour has no data. Throws: Error.
std::unique_ptr<Raster> open_height_map(const std::string& file, const RasterOptions& options = {});

}  // namespace terrace::stream
