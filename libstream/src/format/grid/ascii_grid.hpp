// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// ESRI's ASCII grid: a header of keys (ncols, nrows, xllcorner, ...), then one number per cell
/// from the upper left on, in lines of any length; also GRASS's, with its own keys (north:, rows:,
/// ...). Words for no data (null, *, 1.#QNAN, ...) are cells without data. It is read once, front
/// to back, into a temporary file of binary samples: 32-bit floats if they hold every number
/// exactly, otherwise doubles.
///
/// known: the type of the samples, if another reading of the file has determined it. Then only the
/// header is read before the first window. Not for a pipe.
/// nodata: see RasterOptions.
/// Throws: Error; Stopped if a wait for a pipe is ended.
std::unique_ptr<Raster> open_ascii_grid(const std::string& file, const std::stop_token& stop = {},
                                        std::optional<ScalarType> known = {},
                                        const std::optional<std::string>& nodata = {});

/// The type that open_ascii_grid() would find; reads no further than necessary. Throws: likewise.
ScalarType type_of_ascii_grid(const std::string& file, const std::stop_token& stop = {});

}  // namespace terrace::stream
