// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/geotiff/handle.hpp"
#include "format/geotiff/keys.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The transform from column and row to the sample's position, from pixel scale and tie point or
/// from the matrix. Resolved oddities are added to `comments`. Throws: Error for values that are
/// not finite, a degenerate matrix, or several tie points only.
WorldTransform geotiff_transform(const GeoTiffHandle& handle, const GeoKeys& keys,
                                 std::vector<std::string>& comments);

/// The contents of GDAL_METADATA for one band (counted from 0).
struct BandMetadata {
  std::optional<double> scale, offset;
  std::string unit;
};
BandMetadata band_metadata(const std::string& xml, unsigned band);

/// The unit's name as in Channel::unit, if the text is a known spelling; otherwise the text.
std::string canonical_unit(const std::string& text);

}  // namespace terrace::stream
