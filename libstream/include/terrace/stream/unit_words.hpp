// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace terrace::stream {

/// The one name that Channel::unit and Crs have for a unit of length, by any usual word for it:
/// "ft", "Feet", "foot_intl" are "foot", "us-ft", "ftUS", "US survey feet" are "US survey foot".
/// Words as GDAL, VRT and .aux.xml files, GeoTIFF citations, WKT, EPSG and PROJ have them, in any
/// case. The text itself, without blanks around it, if it is not such a word.
std::string canonical_unit(std::string_view text);

/// A noun in messages after its number: "point" after 1, else "points"; "vertices", "entries".
inline std::string noun_for(bool one, std::string_view noun) {
  if (one) return std::string(noun);
  if (noun == "vertex") return "vertices";
  if (noun == "tetrahedron") return "tetrahedra";
  if (noun.ends_with("ry")) return std::string(noun.substr(0, noun.size() - 1)) + "ies";
  return std::string(noun) + 's';
}

/// Whether it is one of the names that canonical_unit() gives.
bool is_length_unit(std::string_view name);

}  // namespace terrace::stream
