// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cli/cli.hpp"
#include "cli/summary.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::tools {

using namespace terrain;

/// What a file of points or cells holds: told by streaming it once. Throws: stream::Error.
Summary info_of_file(const std::string& path, stream::HeightsOfColour colours,
                     const CommonOptions& common);

/// What a store holds; reads manifest and indices. Throws: stream::Error.
Summary info_of_store(const std::string& path, const CommonOptions& common);

/// {"min": [x, y, z], "max": [x, y, z]}; null for an empty box.
nlohmann::ordered_json json_of(const stream::Box3& box);
/// {"epsg": n, "name": ..., "wkt": ...}; null where nothing is known.
nlohmann::ordered_json json_of(const stream::Crs& crs);
/// {"name": ..., "type": ..., "scale": ..., "offset": ..., "unit": ...}
nlohmann::ordered_json json_of(const stream::Channel& channel);
/// "EPSG:32632 (WGS 84 / UTM zone 32N)" or "unknown", with the operation that leads to WGS 84 where
/// the data lie. bounds: in the CRS.
std::string text_of(const stream::Crs& crs, const stream::Box3& bounds);
/// "1.5 2 3 to 4 5 6" or "none".
std::string text_of(const stream::Box3& box);
/// "height int16 (metre)", with scale and offset where they are not 1 and 0.
std::string text_of(const stream::Channel& channel);

}  // namespace terrace::tools
