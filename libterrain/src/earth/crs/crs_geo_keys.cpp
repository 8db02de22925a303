// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/crs_names.hpp"
#include "earth/crs/epsg_table.hpp"
#include "earth/crs/geo_key_values.hpp"

namespace terrace::terrain {
namespace {

using Kind = KeyOfParameter::Kind;

/// "GCS Name = X|Datum = Y|Ellipsoid = Z|" as GDAL and others write citations.
std::string part_of(const std::string& citation, std::string_view part) {
  std::size_t at = citation.find(std::string(part) + " = ");
  if (at == citation.npos) return {};
  at += part.size() + 3;
  return citation.substr(at, citation.find('|', at) - at);
}

void read_base(const GeoKeyValues& keys, CrsDefinition& definition) {
  const int code = keys.code(2048);
  if (code != 0 && code != kUserDefined) {
    const EpsgGeographic* const row = epsg_geographic(code);
    if (row == nullptr)
      fail_geo_keys("the geographic CRS EPSG:" + std::to_string(code) + " is not known");
    CrsDefinition base = definition_of_epsg(code);
    base.base_epsg = code;
    base.epsg = 0;
    definition = base;
  } else {
    const std::string citation = keys.text(2049);
    definition.base_name = part_of(citation, "GCS Name");
    if (definition.base_name.empty()) definition.base_name = citation;
    definition.datum = part_of(citation, "Datum");
    const int datum = keys.code(2050);
    // The codes of datums and of the old systems on them: 6326 is that of 4326.
    if (datum >= 6001 && datum < 6999) definition.base_epsg = datum - 2000;
    const EpsgGeographic* const row = epsg_geographic(definition.base_epsg);
    if (row != nullptr) {
      definition.ellipsoid = epsg_tables().ellipsoids[static_cast<std::size_t>(row->ellipsoid)];
      definition.base_name = row->name;
      definition.datum = row->datum;
    } else {
      definition.base_epsg = 0;
    }
    if (const auto major = keys.number(2057)) {
      definition.ellipsoid.semi_major = *major;
      if (const auto inverse = keys.number(2059)) {
        definition.ellipsoid.inverse_flattening = *inverse;
      } else if (const auto minor = keys.number(2058)) {
        definition.ellipsoid.inverse_flattening = *minor == *major ? 0 : *major / (*major - *minor);
      } else {
        fail_geo_keys("its ellipsoid has a size and no shape (GeoKeys 2058, 2059)");
      }
    } else if (const int ellipsoid = keys.code(2056); ellipsoid != 0) {
      constexpr std::array<std::pair<int, Ellipsoid>, 5> kCodes{
          {{7030, {6378137, 298.257223563}},
           {7019, {6378137, 298.257222101}},
           {7004, {6377397.155, 299.1528128}},
           {7022, {6378388, 297}},
           {7008, {6378206.4, 294.978698213898}}}};
      const auto* const known =
          std::find_if(kCodes.begin(), kCodes.end(),
                       [ellipsoid](const auto& pair) { return pair.first == ellipsoid; });
      if (known == kCodes.end()) {
        fail_geo_keys("its ellipsoid EPSG:" + std::to_string(ellipsoid) + " is not known");
      }
      definition.ellipsoid = known->second;
    } else if (row == nullptr) {
      fail_geo_keys("its datum is user-defined and has no ellipsoid (GeoKeys 2056 to 2059)");
    }
    if (const auto meridian = keys.number(2061)) definition.prime_meridian = *meridian;
    const int meridian = keys.code(2051);
    if (meridian != 0 && meridian != 8901 && meridian != kUserDefined) {
      fail_geo_keys("its prime meridian EPSG:" + std::to_string(meridian) + " is not known");
    }
    recognise_datum(definition);
  }
  definition.degrees_per_unit = keys.degrees_per_unit();
  if (const stream::GeoKey* const shift = keys.find(2062);
      shift != nullptr && definition.uncertainty < 0) {
    DatumShift values{};
    if (shift->values.size() != 3 && shift->values.size() != 7)
      fail_geo_keys("GeoKey 2062 is no shift");
    std::copy(shift->values.begin(), shift->values.end(), values.begin());
    definition.shift = values;
  }
}

/// GeoTIFF's own numbers of methods.
ProjectionMethod method_of(const GeoKeyValues& keys, const ProjectionParameters& p) {
  using M = ProjectionMethod;
  const int code = keys.code(3075);
  switch (code) {
    case 1:
      return M::transverse_mercator;
    case 3:
      return M::hotine_a;
    case 9815:
      return M::hotine_b;
    case 7:
      return keys.find(3078) != nullptr ? M::mercator_b : M::mercator_a;
    case 8:
      return M::lambert_2sp;
    case 9:
      return M::lambert_1sp;
    case 10:
      return M::lambert_azimuthal;
    case 11:
      return M::albers;
    case 15:
      return std::abs(p.latitude) == 90 ? M::polar_stereographic_a : M::polar_stereographic_b;
    case 16:
      return M::oblique_stereographic;
    case 1024:
      return M::web_mercator;
    default:
      fail_geo_keys(code == 0 ? "its projection has no method (GeoKey 3075)"
                              : "its projection method " + std::to_string(code) +
                                    " (GeoKey 3075) is not known");
  }
}

void read_projection(const GeoKeyValues& keys, CrsDefinition& definition) {
  definition.metres_per_unit = keys.metres_per_unit();
  if (definition.metres_per_unit == 0) fail_geo_keys("its linear unit is missing (GeoKey 3076)");
  const int conversion = keys.code(3074);
  if (conversion != 0 && conversion != kUserDefined) {
    const EpsgConversion* const row = epsg_conversion(conversion);
    if (row == nullptr)
      fail_geo_keys("its projection EPSG:" + std::to_string(conversion) + " is not known");
    definition.method = row->method;
    definition.parameters = row->parameters;
    definition.conversion = row->name;
    return;
  }
  ProjectionParameters& p = definition.parameters;
  for (const KeyOfParameter& parameter : kParameterKeys) {
    const auto value = keys.number(parameter.key);
    if (!value) continue;
    p.*parameter.member = *value * (parameter.kind == Kind::angle    ? definition.degrees_per_unit
                                    : parameter.kind == Kind::length ? definition.metres_per_unit
                                                                     : 1.0);
  }
  definition.method = method_of(keys, p);
  if (*definition.method == ProjectionMethod::polar_stereographic_b) {
    p.parallel1 = std::exchange(p.latitude, 0);
  }
  if (keys.find(3096) == nullptr) p.skew = p.azimuth;
}

}  // namespace

CrsDefinition definition_of_geo_keys(const stream::Crs& crs) {
  const GeoKeyValues keys(crs);
  CrsDefinition definition;
  read_base(keys, definition);
  if (keys.code(1024) == 2) {
    definition.epsg = definition.base_epsg;
    definition.name = definition.base_name;
    return definition;
  }
  definition.heights = Heights::unknown;
  definition.metres_per_height = 0;
  definition.name = part_of(crs.name, "PCS Name");
  if (definition.name.empty()) definition.name = crs.name;
  read_projection(keys, definition);
  definition.degrees_per_unit = 1;
  return definition;
}

}  // namespace terrace::terrain
