// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The registry's entry for GeoTIFF; several files are a mosaic.
const Format& geotiff_format();

}  // namespace terrace::stream
