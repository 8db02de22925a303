// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "format/geotiff/directory.hpp"
#include "terrace/stream/geotiff_writer.hpp"

namespace terrace::stream {

/// The tags of the raster (level 0) or of an overview of that size, without those that say where
/// its tiles are.
TiffDirectory tags_of(const GeoTiffOptions& options, unsigned level, std::uint32_t columns,
                      std::uint32_t rows);

}  // namespace terrace::stream
