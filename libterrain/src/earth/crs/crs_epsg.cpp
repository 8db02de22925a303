// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <utility>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/epsg_table.hpp"

namespace terrace::terrain {
namespace {

/// Codes that are not EPSG's, or not any more, but widespread.
constexpr std::array<std::pair<int, int>, 4> kAliases{
    {{900913, 3857}, {102100, 3857}, {102113, 3857}, {3785, 3857}}};

int alias_of(int code) {
  for (const auto& [alias, meant] : kAliases) {
    if (alias == code) return meant;
  }
  return code;
}

void set_base(CrsDefinition& definition, const EpsgGeographic& row) {
  definition.base_epsg = row.code;
  definition.base_name = row.name;
  definition.datum = row.datum;
  definition.ellipsoid = epsg_tables().ellipsoids[static_cast<std::size_t>(row.ellipsoid)];
  definition.prime_meridian = row.prime_meridian;
  definition.uncertainty = row.uncertainty;
  definition.degrees_per_unit = row.degrees_per_unit;
  if (row.has_height) {
    definition.heights = Heights::ellipsoidal;
    definition.metres_per_height = 1;
  }
}

}  // namespace

std::string name_of(Heights heights) {
  switch (heights) {
    case Heights::ellipsoidal:
      return "ellipsoidal";
    case Heights::orthometric:
      return "orthometric";
    case Heights::unknown:
      break;
  }
  return {};
}

void set_vertical_epsg(CrsDefinition& definition, int code) {
  // GeoTIFF 1.0 numbered heights above ellipsoids so; 5030 is WGS 84's.
  constexpr int kFirstEllipsoid = 5001, kLastEllipsoid = 5033;
  if (code >= kFirstEllipsoid && code <= kLastEllipsoid) {
    definition.heights = Heights::ellipsoidal;
    definition.vertical_epsg = code;
    definition.vertical_name = "height above the ellipsoid";
    if (definition.metres_per_height == 0) definition.metres_per_height = 1;
    return;
  }
  const EpsgVertical* const row = epsg_vertical(code);
  if (row == nullptr) {
    throw CrsError("the vertical CRS EPSG:" + std::to_string(code) + " is not known",
                   "name one that is, or say what heights refer to with --vertical");
  }
  definition.heights = Heights::orthometric;
  definition.vertical_epsg = code;
  definition.vertical_name = row->name;
  definition.metres_per_height = row->metres_per_unit;
}

CrsDefinition definition_of_epsg(int code) {
  CrsDefinition definition;
  if (const EpsgCompound* const row = epsg_compound(code)) {
    definition = definition_of_epsg(row->horizontal);
    set_vertical_epsg(definition, row->vertical);
    return definition;
  }
  const int known = alias_of(code);
  if (const EpsgGeographic* const row = epsg_geographic(known)) {
    set_base(definition, *row);
    definition.epsg = known;
    definition.name = row->name;
    return definition;
  }
  const EpsgProjected* const row = epsg_projected(known);
  if (row == nullptr) {
    if (epsg_vertical(known) != nullptr) {
      throw CrsError("EPSG:" + std::to_string(code) + " is a vertical CRS",
                     "write it behind a horizontal one: EPSG:4326+" + std::to_string(code));
    }
    throw CrsError("the CRS EPSG:" + std::to_string(code) + " is not known",
                   "give another code, or the system's definition as a WKT or PRJ file");
  }
  set_base(definition, *epsg_geographic(row->base));
  const EpsgConversion& conversion = *epsg_conversion(row->conversion);
  definition.epsg = known;
  definition.name = name_of(*row);
  definition.method = conversion.method;
  definition.parameters = conversion.parameters;
  definition.conversion = conversion.name;
  definition.metres_per_unit = row->metres_per_unit;
  return definition;
}

}  // namespace terrace::terrain
