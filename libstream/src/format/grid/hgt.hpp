// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A tile of SRTM: big-endian 16-bit heights above EGM96 without a header, in a file, a zip archive
/// or a gzip file; several of an archive are a mosaic. Its name tells its south-west corner, its
/// size the number of samples; these lie on the lines of the grid, so that neighbours share their
/// outer rows and columns. Throws: Error.
std::unique_ptr<Raster> open_hgt(const std::string& file, const RasterOptions& options = {});

}  // namespace terrace::stream
