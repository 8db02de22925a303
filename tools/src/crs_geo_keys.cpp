// SPDX-License-Identifier: GPL-3.0-or-later
#include "crs_geo_keys.hpp"

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

// Numbers of keys and values: OGC 19-008r4 (GeoTIFF 1.1), annex; 2062 is GDAL's.
namespace terrace::tools {
namespace {

constexpr int kUserDefined = 32767;
constexpr char kRemedy[] = "name the system by its code: --crs EPSG:n";

[[noreturn]] void fail(const std::string& cause) { throw CrsError(cause, kRemedy); }

using P = ProjectionParameters;

struct KeyOfParameter {
  std::uint16_t key;
  double P::*member;
  enum class Kind { angle, length, scale } kind;
};
using Kind = KeyOfParameter::Kind;

// Several keys set one member; a file has one of them.
constexpr std::array<KeyOfParameter, 19> kParameters{{
    {3078, &P::parallel1, Kind::angle},      {3079, &P::parallel2, Kind::angle},
    {3080, &P::longitude, Kind::angle},      {3081, &P::latitude, Kind::angle},
    {3082, &P::false_easting, Kind::length}, {3083, &P::false_northing, Kind::length},
    {3084, &P::longitude, Kind::angle},      {3085, &P::latitude, Kind::angle},
    {3086, &P::false_easting, Kind::length}, {3087, &P::false_northing, Kind::length},
    {3088, &P::longitude, Kind::angle},      {3089, &P::latitude, Kind::angle},
    {3090, &P::false_easting, Kind::length}, {3091, &P::false_northing, Kind::length},
    {3092, &P::scale, Kind::scale},          {3093, &P::scale, Kind::scale},
    {3094, &P::azimuth, Kind::angle},        {3095, &P::longitude, Kind::angle},
    {3096, &P::skew, Kind::angle},
}};

class Keys {
 public:
  explicit Keys(const stream::Crs& crs) : crs_(crs) {}

  [[nodiscard]] const stream::GeoKey* find(int key) const {
    for (const stream::GeoKey& candidate : crs_.geo_keys) {
      if (candidate.key == key) return &candidate;
    }
    return nullptr;
  }
  [[nodiscard]] std::optional<double> number(int key) const {
    const stream::GeoKey* const found = find(key);
    if (found == nullptr || found->values.empty()) return std::nullopt;
    if (!std::isfinite(found->values.front())) {
      fail("GeoKey " + std::to_string(key) + " is not finite");
    }
    return found->values.front();
  }
  /// 0 if there is none.
  [[nodiscard]] int code(int key) const { return static_cast<int>(number(key).value_or(0)); }
  [[nodiscard]] std::string text(int key) const {
    const stream::GeoKey* const found = find(key);
    return found == nullptr ? std::string() : found->text;
  }

 private:
  const stream::Crs& crs_;
};

double degrees_of_unit(const Keys& keys) {
  switch (const int code = keys.code(2054)) {
    case 0:
    case 9102:
    case 9122:
      return 1;
    case 9101:
      return 1 / kDegree;
    case 9103:
      return 1.0 / 60;
    case 9104:
      return 1.0 / 3600;
    case 9105:
    case 9106:
      return 0.9;
    case kUserDefined:
      if (const auto size = keys.number(2055)) return *size / kDegree;
      fail("its angular unit is user-defined and has no size (GeoKey 2055)");
    default:
      fail("its angular unit EPSG:" + std::to_string(code) + " is not known");
  }
}

double metres_of_unit(const Keys& keys, int key, int size_key) {
  switch (const int code = keys.code(key)) {
    case 9001:
      return 1;
    case 9002:
      return 0.3048;
    case 9003:
      return 0.30480060960121924;
    case 9036:
      return 1000;
    case 9005:
      return 0.3047972654;
    case 9014:
      return 1.8288;
    case 9030:
      return 1852;
    case kUserDefined:
      if (const auto size = size_key != 0 ? keys.number(size_key) : std::nullopt) return *size;
      fail("its linear unit is user-defined and has no size (GeoKey " + std::to_string(size_key) +
           ")");
    case 0:
      return 0;
    default:
      fail("its linear unit EPSG:" + std::to_string(code) + " is not known");
  }
}

/// "GCS Name = X|Datum = Y|Ellipsoid = Z|" as GDAL and others write citations.
std::string part_of(const std::string& citation, std::string_view part) {
  std::size_t at = citation.find(std::string(part) + " = ");
  if (at == citation.npos) return {};
  at += part.size() + 3;
  return citation.substr(at, citation.find('|', at) - at);
}

void read_base(const Keys& keys, CrsDefinition& definition) {
  const int code = keys.code(2048);
  if (code != 0 && code != kUserDefined) {
    const EpsgGeographic* const row = epsg_geographic(code);
    if (row == nullptr) fail("the geographic CRS EPSG:" + std::to_string(code) + " is not known");
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
        fail("its ellipsoid has a size and no shape (GeoKeys 2058, 2059)");
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
        fail("its ellipsoid EPSG:" + std::to_string(ellipsoid) + " is not known");
      }
      definition.ellipsoid = known->second;
    } else if (row == nullptr) {
      fail("its datum is user-defined and has no ellipsoid (GeoKeys 2056 to 2059)");
    }
    if (const auto meridian = keys.number(2061)) definition.prime_meridian = *meridian;
    const int meridian = keys.code(2051);
    if (meridian != 0 && meridian != 8901 && meridian != kUserDefined) {
      fail("its prime meridian EPSG:" + std::to_string(meridian) + " is not known");
    }
    recognise_datum(definition);
  }
  definition.degrees_per_unit = degrees_of_unit(keys);
  if (const stream::GeoKey* const shift = keys.find(2062);
      shift != nullptr && definition.uncertainty < 0) {
    DatumShift values{};
    if (shift->values.size() != 3 && shift->values.size() != 7) fail("GeoKey 2062 is no shift");
    std::copy(shift->values.begin(), shift->values.end(), values.begin());
    definition.shift = values;
  }
}

/// GeoTIFF's own numbers of methods.
ProjectionMethod method_of(const Keys& keys, const ProjectionParameters& p) {
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
      fail(code == 0
               ? "its projection has no method (GeoKey 3075)"
               : "its projection method " + std::to_string(code) + " (GeoKey 3075) is not known");
  }
}

void read_projection(const Keys& keys, CrsDefinition& definition) {
  definition.metres_per_unit = metres_of_unit(keys, 3076, 3077);
  if (definition.metres_per_unit == 0) fail("its linear unit is missing (GeoKey 3076)");
  const int conversion = keys.code(3074);
  if (conversion != 0 && conversion != kUserDefined) {
    const EpsgConversion* const row = epsg_conversion(conversion);
    if (row == nullptr) fail("its projection EPSG:" + std::to_string(conversion) + " is not known");
    definition.method = row->method;
    definition.parameters = row->parameters;
    definition.conversion = row->name;
    return;
  }
  ProjectionParameters& p = definition.parameters;
  for (const KeyOfParameter& parameter : kParameters) {
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
  const Keys keys(crs);
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

void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition) {
  const Keys keys(crs);
  const std::string code = "EPSG:" + std::to_string(definition.epsg);
  const auto contradict = [&code](const std::string& what) {
    throw ContradictoryCrs("the GeoKeys contradict each other: " + code + " and " + what,
                           "say which is meant with --crs EPSG:n");
  };
  const int model = keys.code(1024);
  if ((model == 1 && !definition.method) || (model == 2 && definition.method)) {
    contradict(model == 1 ? "a projected model" : "a geographic model");
  }
  if (!definition.method && keys.code(3072) != 0 && keys.code(3072) != kUserDefined) {
    contradict("the projected CRS EPSG:" + std::to_string(keys.code(3072)));
  }
  if (!definition.method) return;
  const int base = keys.code(2048);
  if (base != 0 && base != kUserDefined && base != definition.base_epsg) {
    contradict("the geographic CRS EPSG:" + std::to_string(base));
  }
  const double unit = metres_of_unit(keys, 3076, 3077);
  if (unit != 0 && std::abs(unit / definition.metres_per_unit - 1) > 1e-9) {
    contradict("the unit of " + std::to_string(unit) + " metres");
  }
  const double angle = degrees_of_unit(keys);
  for (const KeyOfParameter& parameter : kParameters) {
    const auto value = keys.number(parameter.key);
    // Methods keep the latitude of true scale and the skew in other keys; those are left out.
    const bool known = [&] {
      for (const ParameterName& name : method_name(*definition.method).parameters) {
        if (name.member == parameter.member) return true;
      }
      return false;
    }();
    if (!value || !known) continue;
    const double given = *value * (parameter.kind == Kind::angle                 ? angle
                                   : parameter.kind == Kind::length && unit != 0 ? unit
                                                                                 : 1.0);
    const ProjectionParameters& p = definition.parameters;
    const auto means = [given](double meant) {
      return std::abs(given - meant) <= 1e-8 * std::max({1.0, std::abs(given), std::abs(meant)});
    };
    // Two parallels mean the same in either order.
    const bool parallel = parameter.member == &P::parallel1 || parameter.member == &P::parallel2;
    if (!means(p.*parameter.member) && !(parallel && (means(p.parallel1) || means(p.parallel2)))) {
      contradict("GeoKey " + std::to_string(parameter.key) + " of " + std::to_string(*value));
    }
  }
}

}  // namespace terrace::tools
