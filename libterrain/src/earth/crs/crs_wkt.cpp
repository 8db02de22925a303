// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/crs_names.hpp"
#include "earth/crs/crs_wkt_parts.hpp"
#include "earth/crs/epsg_table.hpp"
#include "earth/crs/wkt.hpp"

namespace terrace::terrain {
namespace {

constexpr char kByCode[] = "name the system by its code: --crs EPSG:n";

/// Axes must point east and north (up for heights); a polar system's point along meridians, where
/// only their names tell.
void check_axes(const WktNode& node, bool vertical) {
  for (const WktNode& axis : node.parts) {
    if (axis.text != "AXIS" || axis.parts.size() < 2) continue;
    const std::string direction = plain_name(axis.parts[1].text);
    const bool along = axis.find({"MERIDIAN"}) != nullptr;
    const std::string name = plain_name(axis.name());
    const bool named = name.starts_with("e") || name.starts_with("n") || name == "x" || name == "y";
    const bool good = vertical ? direction == "up"
                               : direction == "east" || direction == "north" || direction == "up" ||
                                     direction == "other" || direction == "unspecified" ||
                                     (direction == "south" && (along || named));
    if (!good) {
      fail_wkt("the axis \"" + axis.name() + "\" of the CRS points " + axis.parts[1].text +
               ", and only systems whose axes point east, north and up are known");
    }
  }
}

void read_bound(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const transformation = node.find({"ABRIDGEDTRANSFORMATION"});
  const WktNode* const method =
      transformation != nullptr ? transformation->find({"METHOD"}) : nullptr;
  if (method == nullptr) fail_wkt("the bound CRS has no transformation");
  const std::string name = plain_name(method->name());
  const bool vector = name.starts_with("positionvector");
  const bool frame = name.starts_with("coordinateframe");
  if (!vector && !frame && !name.starts_with("geocentrictranslation")) {
    fail_wkt("the shift \"" + method->name() + "\" to WGS 84 is not known");
  }
  DatumShift shift{};
  for (const WktNode& part : transformation->parts) {
    if (part.text != "PARAMETER" || part.parts.size() < 2) continue;
    const int code = part.epsg();
    if (code < 8605 || code > 8611)
      fail_wkt("the shift's parameter " + part.name() + " is not known");
    const auto i = static_cast<std::size_t>(code - 8605);
    shift[i] = i == 6 ? (part.number(1) - 1) * 1e6 : part.number(1);
    if (frame && i > 2 && i < 6) shift[i] = -shift[i];
  }
  definition.shift = shift;
}

void read_vertical(const WktNode& node, CrsDefinition& definition) {
  check_axes(node, true);
  const int code = node.epsg();
  definition.metres_per_height = wkt_length_unit(node, 1);
  if (epsg_vertical(code) != nullptr) {
    const double unit = definition.metres_per_height;
    set_vertical_epsg(definition, code);
    if (std::abs(definition.metres_per_height / unit - 1) > 1e-6) {
      throw ContradictoryCrs("the vertical CRS \"" + node.name() + "\" contradicts its code EPSG:" +
                                 std::to_string(code) + " in the unit",
                             kByCode);
    }
    return;
  }
  // OGC's type 2002 and ESRI's geodetic datum below a vertical system: above the ellipsoid.
  const WktNode* const datum = node.find({"VERT_DATUM", "VDATUM", "VERTICALDATUM", "DATUM"});
  const bool ellipsoidal =
      datum != nullptr &&
      (datum->text == "DATUM" ||
       (datum->text == "VERT_DATUM" && datum->parts.size() > 1 && datum->parts[1].text == "2002"));
  definition.heights = ellipsoidal ? Heights::ellipsoidal : Heights::orthometric;
  definition.vertical_name = node.name();
}

/// The table's row of the code that the text names: the text must not say anything else.
void take_code(const WktNode& node, CrsDefinition& definition) {
  const int code = node.epsg();
  if (code == 0 || (epsg_projected(code) == nullptr && epsg_geographic(code) == nullptr)) return;
  CrsDefinition known = definition_of_epsg(code);
  const auto differs = [](double a, double b, double scale) {
    return std::abs(a - b) > 1e-9 * std::max({scale, std::abs(a), std::abs(b)});
  };
  std::string what;
  if (known.method.has_value() != definition.method.has_value()) what = "the kind";
  if (differs(known.ellipsoid.semi_major, definition.ellipsoid.semi_major, 1) ||
      differs(known.ellipsoid.flattening(), definition.ellipsoid.flattening(), 1)) {
    what = "the ellipsoid";
  }
  if (known.method && definition.method) {
    if (differs(known.metres_per_unit, definition.metres_per_unit, 1)) what = "the unit";
    const ProjectionParameters& a = known.parameters;
    ProjectionParameters b = definition.parameters;
    if ((a.parallel1 < a.parallel2) != (b.parallel1 < b.parallel2)) {
      std::swap(b.parallel1, b.parallel2);
    }
    if (*known.method == *definition.method) {
      for (const ParameterName& name : method_name(*known.method).parameters) {
        const bool turn = name.member == &ProjectionParameters::azimuth ||
                          name.member == &ProjectionParameters::skew;
        // Metres to a tenth of a millimetre, degrees to as much on the ground.
        if (differs(a.*name.member, b.*name.member, turn ? 360 : 1)) what = name.name;
      }
    }
  }
  if (!what.empty()) {
    throw ContradictoryCrs("the WKT of \"" + node.name() + "\" contradicts its code EPSG:" +
                               std::to_string(code) + " in " + what,
                           kByCode);
  }
  known.shift = definition.uncertainty >= 0 ? std::nullopt : definition.shift;
  definition = known;
}

void read(const WktNode& node, CrsDefinition& definition) {
  const std::string& kind = node.text;
  if (kind == "COMPD_CS" || kind == "COMPOUNDCRS") {
    if (node.parts.size() < 3) fail_wkt("the compound CRS \"" + node.name() + "\" is incomplete");
    read(node.parts[1], definition);
    read_vertical(node.parts[2], definition);
  } else if (kind == "BOUNDCRS") {
    const WktNode* const source = node.find({"SOURCECRS"});
    if (source == nullptr || source->parts.empty()) fail_wkt("the bound CRS has no source");
    read(source->parts[0], definition);
    if (definition.uncertainty < 0) read_bound(node, definition);
  } else if (kind == "PROJCS" || kind == "PROJCRS" || kind == "PROJECTEDCRS") {
    check_axes(node, false);
    read_wkt_projected(node, definition);
    definition.name = node.name();
    take_code(node, definition);
  } else if (kind == "GEOGCS" || kind == "GEOGCRS" || kind == "GEOGRAPHICCRS" ||
             ((kind == "GEODCRS" || kind == "GEODETICCRS") && node.find({"CS"}) != nullptr &&
              plain_name(node.find({"CS"})->parts[0].text) == "ellipsoidal")) {
    read_wkt_geographic(node, definition);
    definition.name = node.name();
    take_code(node, definition);
  } else {
    fail_wkt("a CRS of the kind " + kind.substr(0, 40) + " is not known");
  }
}

}  // namespace

CrsDefinition definition_of_wkt(const std::string& text) {
  const WktNode node = parse_wkt(text);
  CrsDefinition definition;
  read(node, definition);
  if (!definition.method && definition.epsg == 0) definition.epsg = definition.base_epsg;
  return definition;
}

}  // namespace terrace::terrain
