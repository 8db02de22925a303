// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>

#include <nlohmann/json.hpp>

#include "terrace/stream/message.hpp"

namespace terrace::terrain {

/// Size limit of a file of polygons or lines: about 6 million corners.
inline constexpr std::uint64_t kMaxGeoJsonBytes = std::uint64_t{128} << 20;

/// Returns the JSON in a file; nullopt if the file cannot be opened or is a folder. Memory: about
/// ten times the file. Throws: stream::Error with this remedy if the file is larger than max_bytes
/// or is not JSON, in which case it names the place; stream::Stopped.
std::optional<nlohmann::json> json_of_file(const std::string& name, std::uint64_t max_bytes,
                                           const stream::Message& remedy,
                                           const std::stop_token& stop = {});

/// A remedy for files that should be GeoJSON but are not.
std::string convert_to_geojson(const std::string& name);

}  // namespace terrace::terrain
