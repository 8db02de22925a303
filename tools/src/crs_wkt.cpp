// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "crs_definition.hpp"
#include "crs_names.hpp"
#include "epsg_table.hpp"
#include "portable_math.hpp"
#include "units.hpp"
#include "wkt.hpp"

namespace terrace::tools {
namespace {

constexpr char kByCode[] = "name the system by its code: --crs EPSG:n";

[[noreturn]] void fail(const std::string& cause) { throw CrsError(cause, kByCode); }

/// A factor to degrees, cleaned of what radians leave: 0.0174532925199433 stands for a degree.
double degrees_of(double radians) {
  const double degrees = radians / kDegree;
  for (const double exact : {1.0, 0.9, 1.0 / 60, 1.0 / 3600}) {
    if (std::abs(degrees / exact - 1) < 1e-9) return exact;
  }
  return degrees;
}

double metres_of(double metres) {
  constexpr double kSurveyFoot = 0.30480060960121924;  // as the table has it
  return std::abs(metres / kSurveyFoot - 1) < 1e-9 ? kSurveyFoot : metres;
}

/// The unit of a system: its own, else that of its first axis, else `otherwise`.
double unit_of(const WktNode& node, std::initializer_list<std::string_view> keywords,
               double otherwise) {
  if (const WktNode* const unit = node.find(keywords)) return unit->number(1);
  const WktNode* const axis = node.find({"AXIS"});
  const WktNode* const unit = axis != nullptr ? axis->find(keywords) : nullptr;
  return unit != nullptr ? unit->number(1) : otherwise;
}

double angle_unit_of(const WktNode& node, double otherwise) {
  return degrees_of(unit_of(node, {"ANGLEUNIT", "UNIT"}, otherwise * kDegree));
}

double length_unit_of(const WktNode& node, double otherwise) {
  return metres_of(unit_of(node, {"LENGTHUNIT", "UNIT"}, otherwise));
}

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
      fail("the axis \"" + axis.name() + "\" of the CRS points " + axis.parts[1].text +
           ", and only systems whose axes point east, north and up are known");
    }
  }
}

void read_geographic(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const datum = node.find({"DATUM", "GEODETICDATUM", "TRF", "ENSEMBLE", "DYNAMIC"});
  const WktNode* const named =
      datum != nullptr && datum->text == "DYNAMIC" ? node.find({"DATUM", "TRF"}) : datum;
  if (named == nullptr) fail("the geographic CRS \"" + node.name() + "\" has no datum");
  const WktNode* const ellipsoid = named->find({"SPHEROID", "ELLIPSOID"});
  if (ellipsoid == nullptr) fail("the datum \"" + named->name() + "\" has no ellipsoid");
  definition.base_name = node.name();
  definition.base_epsg = node.epsg();
  definition.datum = named->name();
  definition.ellipsoid.semi_major = ellipsoid->number(1) * length_unit_of(*ellipsoid, 1);
  definition.ellipsoid.inverse_flattening = ellipsoid->number(2);
  const Ellipsoid& e = definition.ellipsoid;
  if (!(e.semi_major > 0) || e.inverse_flattening < 0 ||
      (e.inverse_flattening > 0 && e.inverse_flattening < 2)) {
    fail("the ellipsoid \"" + ellipsoid->name() + "\" is impossible");
  }
  definition.degrees_per_unit = angle_unit_of(node, 1);
  if (const WktNode* const meridian = node.find({"PRIMEM", "PRIMEMERIDIAN"})) {
    const bool own = meridian->find({"ANGLEUNIT", "UNIT"}) != nullptr;
    definition.prime_meridian = meridian->number(1) * (own ? angle_unit_of(*meridian, 1) : 1.0);
  }
  if (const WktNode* const shift = named->find({"TOWGS84"})) {
    DatumShift values{};
    if (shift->parts.size() != 3 && shift->parts.size() != 7) fail("TOWGS84 is not 3 or 7 numbers");
    for (std::size_t i = 0; i < shift->parts.size(); ++i) values[i] = shift->number(i);
    definition.shift = values;
  }
  const WktNode* const system = node.find({"CS"});
  if (system != nullptr && system->parts.size() > 1 && system->number(1) == 3) {
    definition.heights = Heights::ellipsoidal;
    definition.metres_per_height = 1;
  }
  recognise_datum(definition);
}

/// GDAL writes Web Mercator as Mercator with PROJ's own words behind it.
bool says_web_mercator(const WktNode& node) {
  const WktNode* const extension = node.find({"EXTENSION"});
  return extension != nullptr && extension->parts.size() > 1 &&
         extension->parts[1].text.find("+nadgrids=@null") != std::string::npos &&
         extension->parts[1].text.find("+proj=merc") != std::string::npos;
}

void read_projected(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const base =
      node.find({"GEOGCS", "BASEGEOGCRS", "BASEGEODCRS", "GEOGCRS", "GEODCRS"});
  if (base == nullptr) fail("the projected CRS \"" + node.name() + "\" has no geographic one");
  read_geographic(*base, definition);
  definition.heights = Heights::unknown;
  definition.metres_per_height = 0;
  const WktNode* const conversion = node.find({"CONVERSION"});
  const WktNode& holder = conversion != nullptr ? *conversion : node;
  definition.conversion = holder.name();
  definition.metres_per_unit = length_unit_of(node, 1);
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
      fail("the projection's parameter \"" + part.name() + "\" is not known");
    }
    double unit = 1;
    if (known->kind == ParameterName::Kind::angle) unit = angle_unit_of(part, angle);
    if (known->kind == ParameterName::Kind::length) unit = length_unit_of(part, length);
    p.*known->member = part.number(1) * unit;
    has_first = has_first || known->member == &ProjectionParameters::parallel1;
    has_second = has_second || known->member == &ProjectionParameters::parallel2;
    has_skew = has_skew || known->member == &ProjectionParameters::skew;
    has_latitude = has_latitude || known->member == &ProjectionParameters::latitude;
  }

  const WktNode* const method = holder.find({"PROJECTION", "METHOD"});
  if (method == nullptr) fail("the CRS \"" + node.name() + "\" names no projection");
  definition.method = method_of_epsg(method->epsg());
  if (!definition.method) {
    definition.method = method_of_name(method->name(), has_first, has_second, p.latitude);
  }
  if (says_web_mercator(node)) definition.method = ProjectionMethod::web_mercator;
  if (!definition.method) fail("the projection \"" + method->name() + "\" is not known");
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

void read_bound(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const transformation = node.find({"ABRIDGEDTRANSFORMATION"});
  const WktNode* const method =
      transformation != nullptr ? transformation->find({"METHOD"}) : nullptr;
  if (method == nullptr) fail("the bound CRS has no transformation");
  const std::string name = plain_name(method->name());
  const bool vector = name.starts_with("positionvector");
  const bool frame = name.starts_with("coordinateframe");
  if (!vector && !frame && !name.starts_with("geocentrictranslation")) {
    fail("the shift \"" + method->name() + "\" to WGS 84 is not known");
  }
  DatumShift shift{};
  for (const WktNode& part : transformation->parts) {
    if (part.text != "PARAMETER" || part.parts.size() < 2) continue;
    const int code = part.epsg();
    if (code < 8605 || code > 8611) fail("the shift's parameter " + part.name() + " is not known");
    const auto i = static_cast<std::size_t>(code - 8605);
    shift[i] = i == 6 ? (part.number(1) - 1) * 1e6 : part.number(1);
    if (frame && i > 2 && i < 6) shift[i] = -shift[i];
  }
  definition.shift = shift;
}

void read_vertical(const WktNode& node, CrsDefinition& definition) {
  check_axes(node, true);
  const int code = node.epsg();
  definition.metres_per_height = length_unit_of(node, 1);
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
    if (node.parts.size() < 3) fail("the compound CRS \"" + node.name() + "\" is incomplete");
    read(node.parts[1], definition);
    read_vertical(node.parts[2], definition);
  } else if (kind == "BOUNDCRS") {
    const WktNode* const source = node.find({"SOURCECRS"});
    if (source == nullptr || source->parts.empty()) fail("the bound CRS has no source");
    read(source->parts[0], definition);
    if (definition.uncertainty < 0) read_bound(node, definition);
  } else if (kind == "PROJCS" || kind == "PROJCRS" || kind == "PROJECTEDCRS") {
    check_axes(node, false);
    read_projected(node, definition);
    definition.name = node.name();
    take_code(node, definition);
  } else if (kind == "GEOGCS" || kind == "GEOGCRS" || kind == "GEOGRAPHICCRS" ||
             ((kind == "GEODCRS" || kind == "GEODETICCRS") && node.find({"CS"}) != nullptr &&
              plain_name(node.find({"CS"})->parts[0].text) == "ellipsoidal")) {
    read_geographic(node, definition);
    definition.name = node.name();
    take_code(node, definition);
  } else {
    fail("a CRS of the kind " + kind.substr(0, 40) + " is not known");
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

}  // namespace terrace::tools
