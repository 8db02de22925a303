// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/geotiff/handle.hpp"
#include "format/geotiff/keys.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// From column and row to the sample's place, out of pixel scale and tie point or the matrix.
/// Oddities that were resolved are added to `comments`.
/// Throws: Error for values that are not finite, a degenerate matrix, or several tie points alone.
WorldTransform geotiff_transform(const GeoTiffHandle& handle, const GeoKeys& keys,
                                 std::vector<std::string>& comments);

/// What GDAL_METADATA says of one band (counted from 0).
struct BandMetadata {
  std::optional<double> scale, offset;
  std::string unit;
};
BandMetadata band_metadata(const std::string& xml, unsigned band);

/// The unit's name as Channel::unit has it, where the text is a known spelling; else the text.
std::string canonical_unit(const std::string& text);

}  // namespace terrace::stream
