// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Opens an Esri ASCII grid: a header of keys (ncols, nrows, xllcorner, ...), then one number per
/// cell, beginning at the upper left, in lines of any length. Also opens GRASS's ASCII grids, which
/// have other keys (north:, rows:, ...). Words for nodata (null, *, 1.#QNAN, ...) are cells without
/// data. The file is read once, from front to back, into a temporary file of binary samples: 32-bit
/// floats if they hold every number exactly, otherwise doubles.
///
/// known: the type of the samples, if an earlier reading of the file has determined it. Then only
/// the header is read before the first window. Not for a pipe.
/// nodata: see RasterOptions.
/// Throws: Error; Stopped if waiting for a pipe is stopped.
std::unique_ptr<Raster> open_ascii_grid(const std::string& file, const std::stop_token& stop = {},
                                        std::optional<ScalarType> known = {},
                                        const std::optional<std::string>& nodata = {});

/// The type that open_ascii_grid() would determine; reads no further than necessary. Throws: as
/// open_ascii_grid().
ScalarType type_of_ascii_grid(const std::string& file, const std::stop_token& stop = {});

}  // namespace terrace::stream
