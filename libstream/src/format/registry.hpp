// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "terrace/stream/source.hpp"

/// The registry of formats. Each entry is defined in the source file of its format.

namespace terrace::stream {

/// GeoTIFF; several files are a mosaic.
const Format& geotiff_format();
/// GDAL's virtual rasters that are mosaics of other rasters.
const Format& vrt_format();
/// ASPRS LAS 1.0 to 1.4.
const Format& las_format();
/// Entwine Point Tile: a folder with an octree of files.
const Format& ept_format();
/// The Stanford polygon format: ASCII, binary little-endian and big-endian.
const Format& ply_format();
/// The vertices of binary glTF, of Wavefront's OBJ and of Geomview's OFF, and the corners of STL:
/// see mesh/points.cpp.
const Format& glb_format();
const Format& obj_format();
const Format& off_format();
const Format& stl_format();
/// GeoJSON, also newline-delimited: the positions of its geometries, or its lines.
const Format& geojson_format();
/// SRTM tiles without a header, also in .zip and .gz.
const Format& hgt_format();
/// Esri ASCII grids.
const Format& ascii_grid_format();
/// Esri binary grids with a header file: .flt, .bil, .bip, .bsq.
const Format& binary_grid_format();
/// USGS digital elevation models in ASCII.
const Format& usgs_dem_format();
/// PNG: grey height maps, and colours that encode heights.
const Format& png_format();
/// Text with one point per line: XYZ, CSV and the like.
const Format& xyz_format();

/// Returns the format of a file's ending (".csv.gz" counts as ".csv"); nullptr if none.
const Format* format_of_name(const std::string& file);

/// Determines the format by options.format, else by content, else by ending. A file with a known
/// ending but unknown content goes to that ending's reader, which can best report what is wrong.
/// Throws: Error for other formats, with a remedy for common ones. Throws: std::invalid_argument
/// for an unknown options.format. Throws: Stopped.
const Format& format_of(const std::string& file, const SourceOptions& options);
/// Returns the format that unpacks files itself and has this file's double ending, such as
/// ".hgt.zip"; nullptr if none.
const Format* packed_format_of(const std::string& file);
/// Returns the names of all formats, or of those with a capability, with commas.
std::string names_of_formats(bool Format::*capability = nullptr);

}  // namespace terrace::stream
