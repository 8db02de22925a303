// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "format/grid/header.hpp"
#include "format/grid/plain.hpp"

namespace terrace::stream {

/// Opens an Esri binary grid: rows of samples in NAME.flt, .bil, .bip, .bsq or .dem, described by
/// NAME.hdr. Throws: Error.
std::unique_ptr<Raster> open_binary_grid(const std::string& file,
                                         const RasterOptions& options = {});

/// Returns the header file next to a binary grid; empty if there is none.
std::filesystem::path binary_header_of(const std::string& file);

/// Returns the keys and values of a header's lines. file: for messages.
GridHeader read_binary_header(const std::string& file, std::string_view text);
/// Returns the grid described by the header. floats: samples are 32-bit floats, as in a .flt.
PlainGrid describe_binary_grid(const std::string& file, const GridHeader& header, bool floats,
                               int band);

}  // namespace terrace::stream
