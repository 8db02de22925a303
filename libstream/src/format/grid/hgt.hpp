// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens an SRTM tile: big-endian 16-bit heights above EGM96 without a header, in a file, a zip
/// archive or a gzip file; several tiles in an archive are a mosaic. The name gives the south-west
/// corner, the file size the number of samples. The samples are on the lines of the grid, so
/// neighbouring tiles share their outer rows and columns. Throws: Error.
std::unique_ptr<Raster> open_hgt(const std::string& file, const RasterOptions& options = {});

}  // namespace terrace::stream
