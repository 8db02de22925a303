// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

/// Open rasters of the formats in this folder. binary.hpp has one more.

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

/// Returns the type that open_ascii_grid() would determine; reads no further than necessary.
/// Throws: as open_ascii_grid().
ScalarType type_of_ascii_grid(const std::string& file, const std::stop_token& stop = {});

/// Opens a USGS digital elevation model in ASCII: a record A of fixed columns, then one profile
/// (record B) per column of the grid, from south to north and west to east. Coordinates are in UTM,
/// in arc seconds, or in an unspecified plane; heights in feet or metres. The file is read once,
/// from front to back, into a temporary file. Samples are the file's integers, with its vertical
/// resolution as scale.
///
/// Source: USGS, Standards for Digital Elevation Models, part 2, appendix 2-A and 2-B, 1998.
/// Throws: Error; Stopped if waiting for a pipe is stopped.
std::unique_ptr<Raster> open_usgs_dem(const std::string& file, const std::stop_token& stop = {});

/// Opens an SRTM tile: big-endian 16-bit heights above EGM96 without a header, in a file, a zip
/// archive or a gzip file. Several tiles in an archive form a mosaic. The name gives the south-west
/// corner, the file size the number of samples. The samples are on the lines of the grid, so
/// neighbouring tiles share their outer rows and columns. Throws: Error.
std::unique_ptr<Raster> open_hgt(const std::string& file, const RasterOptions& options = {});

/// Opens a PNG of 8 or 16 bits whose grey values are heights, or whose colours encode heights as
/// set in the options. A world file (.pgw, .pngw or .wld) georeferences it; without one it is a
/// plain grid of unit cells. Pixels with a transparent colour have no data. Throws: Error.
std::unique_ptr<Raster> open_height_map(const std::string& file, const RasterOptions& options = {});

}  // namespace terrace::stream
