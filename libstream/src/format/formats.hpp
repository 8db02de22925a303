// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/stream/source.hpp"

/// The registry's entries, each from the file of its format.

namespace terrace::stream {

/// GeoTIFF; several files are a mosaic.
const Format& geotiff_format();
/// The Stanford polygon format: ASCII, binary little-endian and big-endian.
const Format& ply_format();
/// Text of one point per line: XYZ, CSV and their like.
const Format& xyz_format();

}  // namespace terrace::stream
