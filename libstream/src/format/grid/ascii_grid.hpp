// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// ESRI's ASCII grid: a head of keys (ncols, nrows, xllcorner, ...), then one number a cell from
/// the upper left on, in lines of any length. It is read once, front to back, into a temporary file
/// of binary samples: 32-bit floats if every number is one exactly, else doubles.
///
/// known: the type of the samples, where another reading of the file has told it. Then nothing but
/// the head is read before the first window. Not for a pipe.
/// Throws: Error; Stopped, where the wait for a pipe is ended.
std::unique_ptr<Raster> open_ascii_grid(const std::string& file, const std::stop_token& stop = {},
                                        std::optional<ScalarType> known = {});

/// The type that open_ascii_grid() would find; reads no further than it must. Throws: as that.
ScalarType type_of_ascii_grid(const std::string& file, const std::stop_token& stop = {});

}  // namespace terrace::stream
