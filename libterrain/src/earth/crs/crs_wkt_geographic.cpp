// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>

#include "base/portable_math.hpp"
#include "earth/crs/crs_wkt_parts.hpp"

namespace terrace::terrain {
namespace {

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

}  // namespace

void fail_wkt(const std::string& cause) {
  throw CrsError(cause, "name the system by its code: --crs EPSG:n");
}

double wkt_angle_unit(const WktNode& node, double otherwise) {
  return degrees_of(unit_of(node, {"ANGLEUNIT", "UNIT"}, otherwise * kDegree));
}

double wkt_length_unit(const WktNode& node, double otherwise) {
  return metres_of(unit_of(node, {"LENGTHUNIT", "UNIT"}, otherwise));
}

void read_wkt_geographic(const WktNode& node, CrsDefinition& definition) {
  const WktNode* const datum = node.find({"DATUM", "GEODETICDATUM", "TRF", "ENSEMBLE", "DYNAMIC"});
  const WktNode* const named =
      datum != nullptr && datum->text == "DYNAMIC" ? node.find({"DATUM", "TRF"}) : datum;
  if (named == nullptr) fail_wkt("the geographic CRS \"" + node.name() + "\" has no datum");
  const WktNode* const ellipsoid = named->find({"SPHEROID", "ELLIPSOID"});
  if (ellipsoid == nullptr) fail_wkt("the datum \"" + named->name() + "\" has no ellipsoid");
  definition.base_name = node.name();
  definition.base_epsg = node.epsg();
  definition.datum = named->name();
  definition.ellipsoid.semi_major = ellipsoid->number(1) * wkt_length_unit(*ellipsoid, 1);
  definition.ellipsoid.inverse_flattening = ellipsoid->number(2);
  const Ellipsoid& e = definition.ellipsoid;
  if (!(e.semi_major > 0) || e.inverse_flattening < 0 ||
      (e.inverse_flattening > 0 && e.inverse_flattening < 2)) {
    fail_wkt("the ellipsoid \"" + ellipsoid->name() + "\" is impossible");
  }
  definition.degrees_per_unit = wkt_angle_unit(node, 1);
  if (const WktNode* const meridian = node.find({"PRIMEM", "PRIMEMERIDIAN"})) {
    const bool own = meridian->find({"ANGLEUNIT", "UNIT"}) != nullptr;
    definition.prime_meridian = meridian->number(1) * (own ? wkt_angle_unit(*meridian, 1) : 1.0);
  }
  if (const WktNode* const shift = named->find({"TOWGS84"})) {
    DatumShift values{};
    if (shift->parts.size() != 3 && shift->parts.size() != 7)
      fail_wkt("TOWGS84 is not 3 or 7 numbers");
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

}  // namespace terrace::terrain
