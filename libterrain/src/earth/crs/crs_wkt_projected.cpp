// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>

#include "earth/crs/crs_names.hpp"
#include "earth/crs/crs_wkt_parts.hpp"

namespace terrace::terrain {
namespace {

/// GDAL writes Web Mercator as Mercator with PROJ's own words behind it.
bool says_web_mercator(const WktNode& node) {
  const WktNode* const extension = node.find({"EXTENSION"});
  return extension != nullptr && extension->parts.size() > 1 &&
         extension->parts[1].text.find("+nadgrids=@null") != std::string::npos &&
         extension->parts[1].text.find("+proj=merc") != std::string::npos;
}

}  // namespace

void read_wkt_projected(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const base =
      node.find({"GEOGCS", "BASEGEOGCRS", "BASEGEODCRS", "GEOGCRS", "GEODCRS"});
  if (base == nullptr) fail_wkt("the projected CRS \"" + node.name() + "\" has no geographic one");
  read_wkt_geographic(*base, definition);
  definition.heights = Heights::unknown;
  definition.metres_per_height = 0;
  const WktNode* const conversion = node.find({"CONVERSION"});
  const WktNode& holder = conversion != nullptr ? *conversion : node;
  definition.conversion = holder.name();
  definition.metres_per_unit = wkt_length_unit(node, 1);
  const double angle = conversion != nullptr ? 1.0 : definition.degrees_per_unit;
  const double length = conversion != nullptr ? 1.0 : definition.metres_per_unit;

  bool has_first = false, has_second = false, has_skew = false, has_latitude = false;
  ProjectionParameters& p = definition.parameters;
  for (const WktNode& part : holder.parts) {
    if (part.text != "PARAMETER" || part.parts.size() < 2) continue;
    const ParameterName* const known = parameter_of_name(part.name());
    if (known == nullptr) {
      const std::string plain = plain_name(part.name());
      if (plain == "auxiliaryspheretype" && part.number(1) == 0) continue;
      fail_wkt("the projection's parameter \"" + part.name() + "\" is not known");
    }
    double unit = 1;
    if (known->kind == ParameterName::Kind::angle) unit = wkt_angle_unit(part, angle);
    if (known->kind == ParameterName::Kind::length) unit = wkt_length_unit(part, length);
    p.*known->member = part.number(1) * unit;
    has_first = has_first || known->member == &ProjectionParameters::parallel1;
    has_second = has_second || known->member == &ProjectionParameters::parallel2;
    has_skew = has_skew || known->member == &ProjectionParameters::skew;
    has_latitude = has_latitude || known->member == &ProjectionParameters::latitude;
  }

  const WktNode* const method = holder.find({"PROJECTION", "METHOD"});
  if (method == nullptr) fail_wkt("the CRS \"" + node.name() + "\" names no projection");
  definition.method = method_of_epsg(method->epsg());
  if (!definition.method) {
    definition.method = method_of_name(method->name(), has_first, has_second, p.latitude);
  }
  if (says_web_mercator(node)) definition.method = ProjectionMethod::web_mercator;
  if (!definition.method) fail_wkt("the projection \"" + method->name() + "\" is not known");
  using M = ProjectionMethod;
  // Dialects put the one latitude that there is into different parameters.
  if (*definition.method == M::polar_stereographic_b && !has_first) p.parallel1 = p.latitude;
  if (*definition.method == M::lambert_1sp && !has_latitude) p.latitude = p.parallel1;
  if (*definition.method == M::lambert_1sp && has_first) {
    if (p.latitude != p.parallel1) {
      p.parallel2 = p.parallel1;
      definition.method = M::lambert_2sp;
    } else {
      p.parallel1 = 0;
    }
  }
  if (*definition.method == M::polar_stereographic_b) p.latitude = 0;
  if ((*definition.method == M::hotine_a || *definition.method == M::hotine_b) && !has_skew) {
    p.skew = p.azimuth;
  }
}

}  // namespace terrace::terrain
