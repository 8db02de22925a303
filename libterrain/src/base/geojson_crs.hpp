// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>
#include <terrace/stream/schema.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Returns the CRS of a GeoJSON object's places by its `crs` member, as in GeoJSON 2008; nullopt if
/// the member is null, which means the CRS of the data. file: named in the error. Throws:
/// stream::Error for a member that does not name a CRS.
std::optional<PlacesCrs> crs_of_geojson(const nlohmann::json& object, const std::string& file);

/// Returns the member that names a CRS in GeoJSON, with the comma after it: null if nothing is
/// known about the CRS, empty for longitude and latitude of WGS 84.
std::string geojson_crs_member(const stream::Crs& crs);

}  // namespace terrace::terrain
