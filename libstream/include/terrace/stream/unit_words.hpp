// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace terrace::stream {

/// Returns the name that Channel::unit and Crs use for a unit of length, given any usual word for
/// it: "foot" for "ft", "Feet" and "foot_intl"; "US survey foot" for "us-ft", "ftUS" and "US survey
/// feet". Knows the words of GDAL, VRT and .aux.xml files, GeoTIFF citations, WKT, EPSG and PROJ,
/// and ignores case. Returns other text unchanged, but trimmed.
std::string canonical_unit(std::string_view text);

/// The form of a noun after its number in messages: "point" if `one`, else "points"; "vertices".
inline std::string noun_for(bool one, std::string_view noun) {
  if (one) return std::string(noun);
  if (noun == "vertex") return "vertices";
  if (noun == "tetrahedron") return "tetrahedra";
  if (noun.ends_with("ry")) return std::string(noun.substr(0, noun.size() - 1)) + "ies";
  return std::string(noun) + 's';
}

/// True for the names of units that canonical_unit() returns.
bool is_length_unit(std::string_view name);

}  // namespace terrace::stream
