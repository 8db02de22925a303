// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens a USGS digital elevation model in ASCII: a record A of fixed columns, then one profile
/// (record B) per column of the grid, from south to north and west to east. Coordinates are in UTM,
/// in arc seconds, or in an unspecified plane; heights in feet or metres. The file is read once,
/// from front to back, into a temporary file. Samples are the file's integers, with its vertical
/// resolution as scale.
///
/// Source: USGS, Standards for Digital Elevation Models, part 2, appendix 2-A and 2-B, 1998.
/// Throws: Error; Stopped if waiting for a pipe is stopped.
std::unique_ptr<Raster> open_usgs_dem(const std::string& file, const std::stop_token& stop = {});

}  // namespace terrace::stream
