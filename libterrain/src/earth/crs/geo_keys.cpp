// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/geo_keys.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>

#include "base/units.hpp"
#include "earth/crs/proj_reader.hpp"
#include "earth/crs/projection_names.hpp"

namespace terrace::terrain {
namespace {

/// Code for "user-defined": the other keys define the system.
constexpr int kUserDefined = 32767;

CrsError fault(const std::string& cause) { return {cause, remedy_by_code()}; }

/// The GeoKeys of one file.
class GeoKeyValues {
 public:
  explicit GeoKeyValues(const stream::Crs& crs) : crs_(crs) {}

  [[nodiscard]] const stream::GeoKey* find(int key) const {
    for (const stream::GeoKey& candidate : crs_.geo_keys) {
      if (candidate.key == key) return &candidate;
    }
    return nullptr;
  }
  /// Returns nullopt if the key is missing. Throws: CrsError if the number is not finite.
  [[nodiscard]] std::optional<double> number(int key) const {
    const stream::GeoKey* const found = find(key);
    if (found == nullptr || found->values.empty()) return std::nullopt;
    if (!std::isfinite(found->values.front())) {
      throw fault(fmt::format("GeoKey {} is not finite", key));
    }
    return found->values.front();
  }
  /// Returns 0 if the key is missing. Throws: CrsError unless it is a 16-bit integer, as codes are.
  [[nodiscard]] int code(int key) const {
    const double value = number(key).value_or(0);
    if (!(value >= 0 && value <= 65535 && value == std::floor(value))) {
      throw fault(fmt::format("GeoKey {} is not a code", key));
    }
    return static_cast<int>(value);
  }
  /// Also returns 0 for systems defined by parameters.
  [[nodiscard]] int known_code(int key) const {
    const int value = code(key);
    return value == kUserDefined ? 0 : value;
  }
  [[nodiscard]] std::string text(int key) const {
    const stream::GeoKey* const found = find(key);
    return found == nullptr ? std::string() : found->text;
  }
  /// Returns radians per angular or metres per linear unit; 0 if the file names no unit. Throws:
  /// CrsError for an unknown unit.
  [[nodiscard]] double unit(int key, const char* kind) const {
    const int unit = code(key);
    if (unit == 0) return 0;
    if (unit == kUserDefined) {
      if (const auto size = number(key + 1); size && *size > 0) return *size;
      throw fault(
          fmt::format("its {} unit is user-defined and has no size (GeoKey {})", kind, key + 1));
    }
    double factor = 0;
    const char* category = nullptr;
    const bool known =
        proj_uom_get_info_from_database(proj_context(), "EPSG", fmt::format("{}", unit).c_str(),
                                        nullptr, &factor, &category) != 0;
    check_proj_database();
    if (!known || text_of(category) != kind || !(factor > 0)) {
      throw fault(fmt::format("its {} unit EPSG:{} is not known", kind, unit));
    }
    return factor;
  }
  [[nodiscard]] double degrees_per_unit() const {
    const double radians = unit(2054, "angular");
    return radians == 0 ? 1 : degrees_of(radians);
  }
  [[nodiscard]] double metres_per_unit() const {
    const double metres = unit(3076, "linear");
    return metres == 0 ? 0 : metres_of(metres);
  }

 private:
  const stream::Crs& crs_;
};

using Role = ParameterRole;

/// The role of each parameter key. Several keys share a role; a file uses one of them.
struct RoleOfKey {
  int key;
  Role role;
};
constexpr std::array<RoleOfKey, 19> kRoles{{
    {3078, Role::parallel1},      {3079, Role::parallel2},      {3080, Role::longitude},
    {3081, Role::latitude},       {3082, Role::false_easting},  {3083, Role::false_northing},
    {3084, Role::longitude},      {3085, Role::latitude},       {3086, Role::false_easting},
    {3087, Role::false_northing}, {3088, Role::longitude},      {3089, Role::latitude},
    {3090, Role::false_easting},  {3091, Role::false_northing}, {3092, Role::scale},
    {3093, Role::scale},          {3094, Role::azimuth},        {3095, Role::longitude},
    {3096, Role::skew},
}};

/// GeoTIFF's method numbers, each with the codes of EPSG's method and its parameters.
struct MethodOfKey {
  int number;
  int code;
  std::array<int, 7> parameters;  ///< padded with zeros
};
constexpr std::array<MethodOfKey, 15> kMethods{{
    {1, 9807, {8801, 8802, 8805, 8806, 8807}},
    {3, 9812, {8811, 8812, 8813, 8814, 8815, 8806, 8807}},
    {7, 9804, {8801, 8802, 8805, 8806, 8807}},
    {-7, 9805, {8823, 8802, 8806, 8807}},  // with a standard parallel
    {8, 9802, {8821, 8822, 8823, 8824, 8826, 8827}},
    {9, 9801, {8801, 8802, 8805, 8806, 8807}},
    {10, 9820, {8801, 8802, 8806, 8807}},
    {11, 9822, {8821, 8822, 8823, 8824, 8826, 8827}},
    {15, 9810, {8801, 8802, 8805, 8806, 8807}},
    {-15, 9829, {8832, 8833, 8806, 8807}},  // with a latitude of true scale instead of an origin at
                                            // the pole
    {16, 9809, {8801, 8802, 8805, 8806, 8807}},
    {18, 9806, {8801, 8802, 8806, 8807}},
    {27, 9808, {8801, 8802, 8805, 8806, 8807}},
    {1024, 1024, {8801, 8802, 8806, 8807}},
    {9815, 9815, {8811, 8812, 8813, 8814, 8815, 8816, 8817}},
}};

/// Methods without an EPSG code, or without one in some releases, with their PROJ names.
struct NamedMethod {
  int number;
  const char* name;
};
constexpr std::array<NamedMethod, 12> kNamedMethods{{
    {12, "aeqd"},
    {13, "eqdc"},
    {14, "stere"},
    {17, "eqc"},
    {19, "gnom"},
    {20, "mill"},
    {21, "ortho"},
    {22, "poly"},
    {23, "robin"},
    {24, "sinu"},
    {25, "vandg"},
    {28, "cea"},
}};

/// Returns degrees, metres or a factor; nullopt if no key has the role.
std::optional<double> value_of(const GeoKeyValues& keys, Role role, double degrees, double metres) {
  for (const RoleOfKey& row : kRoles) {
    if (row.role != role) continue;
    if (const auto value = keys.number(row.key)) {
      const ParameterKind kind = kind_of(role);
      return *value * (kind == ParameterKind::angle    ? degrees
                       : kind == ParameterKind::length ? metres
                                                       : 1.0);
    }
  }
  return std::nullopt;
}

/// Returns a part of a citation "GCS Name = X|Datum = Y|Ellipsoid = Z|", as GDAL and others write
/// it.
std::string part_of(const std::string& citation, std::string_view part) {
  std::size_t at = citation.find(std::string(part) + " = ");
  if (at == citation.npos) return {};
  at += part.size() + 3;
  return citation.substr(at, citation.find('|', at) - at);
}

ProjObject object_of_code(int code, PJ_CATEGORY category) {
  ProjObject object(proj_create_from_database(
      proj_context(), "EPSG", fmt::format("{}", code).c_str(), category, 0, nullptr));
  check_proj_database();
  return object;
}

/// Returns null for a CRS of another kind, because PROJ crashes when it identifies a projected CRS
/// on a geocentric one, for example.
ProjObject geographic_of_code(int code) {
  ProjObject found = object_of_code(code, PJ_CATEGORY_CRS);
  if (found == nullptr) return nullptr;
  const PJ_TYPE type = proj_get_type(found.get());
  const bool good = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  return good ? std::move(found) : nullptr;
}

ProjObject required(ProjObject object, const std::string& what) {
  if (object == nullptr) throw fault(what);
  return object;
}

/// Whether the parameters that a file gives with a datum's code match a system on that datum.
bool agrees(const GeoKeyValues& keys, const PJ* base) {
  PJ_CONTEXT* const context = proj_context();
  const ProjObject ellipsoid(proj_get_ellipsoid(context, base));
  const ProjObject meridian(proj_get_prime_meridian(context, base));
  double major = 0, minor = 0, inverse = 0, longitude = 0;
  proj_ellipsoid_get_parameters(context, ellipsoid.get(), &major, &minor, nullptr, &inverse);
  proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, nullptr, nullptr);
  const auto is = [&keys](int key, double value, double tolerance) {
    const auto recorded = keys.number(key);
    return !recorded || std::abs(*recorded - value) <= tolerance;
  };
  return is(2057, major, 1e-3) && is(2058, minor, 1e-3) && is(2059, inverse, 1e-6) &&
         is(2061, longitude, 1e-9);
}

ProjObject base_of(const GeoKeyValues& keys) {
  PJ_CONTEXT* const context = proj_context();
  if (const int code = keys.known_code(2048); code != 0) {
    return required(geographic_of_code(code),
                    fmt::format("the geographic CRS EPSG:{} is not known", code));
  }
  const std::string citation = keys.text(2049);
  std::string name = part_of(citation, "GCS Name"), datum = part_of(citation, "Datum");
  if (name.empty()) name = citation;
  const double degrees = keys.degrees_per_unit();
  // Old files give the code of a datum instead of the system on it, such as 6326 for 4326.
  const int datum_code = keys.known_code(2050);
  if (datum_code >= 6001 && datum_code < 6999 && degrees == 1) {
    ProjObject base = geographic_of_code(datum_code - 2000);
    if (base != nullptr && agrees(keys, base.get())) return base;
  }
  double major = 0, inverse = 0;
  if (const auto size = keys.number(2057)) {
    major = *size;
    if (const auto flattening = keys.number(2059)) {
      inverse = *flattening;
    } else if (const auto minor = keys.number(2058)) {
      inverse = *minor == major ? 0 : major / (major - *minor);
    } else {
      throw fault("its ellipsoid has a size but no shape (GeoKeys 2058, 2059)");
    }
  } else if (const int ellipsoid = keys.known_code(2056); ellipsoid != 0) {
    const ProjObject known = required(object_of_code(ellipsoid, PJ_CATEGORY_ELLIPSOID),
                                      fmt::format("its ellipsoid EPSG:{} is not known", ellipsoid));
    proj_ellipsoid_get_parameters(context, known.get(), &major, nullptr, nullptr, &inverse);
  } else {
    throw fault("its datum is user-defined and has no ellipsoid (GeoKeys 2056 to 2059)");
  }
  double meridian = keys.number(2061).value_or(0);
  if (const int code = keys.known_code(2051); code != 0) {
    const ProjObject known = required(object_of_code(code, PJ_CATEGORY_PRIME_MERIDIAN),
                                      fmt::format("its prime meridian EPSG:{} is not known", code));
    double unit = base::kRadiansPerDegree;
    proj_prime_meridian_get_parameters(context, known.get(), &meridian, &unit, nullptr);
    if (meridian != 0) meridian *= degrees_of(unit);
  }
  const ProjObject axes(proj_create_ellipsoidal_2D_cs(
      context, PJ_ELLPS2D_LATITUDE_LONGITUDE, degrees == 1 ? "degree" : "unknown",
      degrees == 1 ? 0 : degrees * base::kRadiansPerDegree));
  return required(ProjObject(proj_create_geographic_crs(
                      context, name.empty() ? "unnamed" : name.c_str(),
                      datum.empty() ? "unknown" : datum.c_str(), "unnamed", major, inverse,
                      meridian == 0 ? "Greenwich" : "unknown", meridian, "degree", 0, axes.get())),
                  "its geographic CRS is impossible");
}

/// Reads the shift to WGS 84, if there is one.
void read_shift(const GeoKeyValues& keys, CrsDefinition& definition) {
  const stream::GeoKey* const shift = keys.find(2062);
  if (shift == nullptr) return;
  DatumShift values{};
  if (shift->values.size() != 3 && shift->values.size() != 7) {
    throw fault("GeoKey 2062 is not a shift");
  }
  std::copy(shift->values.begin(), shift->values.end(), values.begin());
  for (const double value : values) {
    if (!std::isfinite(value)) throw fault("GeoKey 2062 is not finite");
  }
  if (definition.base_epsg == 0 || values != DatumShift{}) definition.shift = values;
}

ProjObject conversion_by_name(const std::string& name, const GeoKeyValues& keys, double degrees,
                              double metres) {
  std::string text = "+proj=" + name;
  const auto add = [&](const char* parameter, Role role) {
    const auto value = value_of(keys, role, degrees, metres);
    if (value && *value != (kind_of(role) == ParameterKind::scale ? 1 : 0)) {
      text += std::string(" +") + parameter + "=" + number_text(*value);
    }
  };
  add("lat_0", Role::latitude);
  add("lon_0", Role::longitude);
  add(name == "eqdc" ? "lat_1" : "lat_ts", Role::parallel1);
  add("lat_2", Role::parallel2);
  add("k_0", Role::scale);
  add("x_0", Role::false_easting);
  add("y_0", Role::false_northing);
  const ProjObject crs = proj_crs_of_text(text + " +type=crs");
  return required(ProjObject(proj_crs_get_coordoperation(proj_context(), crs.get())),
                  "its projection is impossible");
}

ProjObject conversion_of(const GeoKeyValues& keys, double degrees, double metres) {
  if (const int code = keys.known_code(3074); code != 0) {
    return required(object_of_code(code, PJ_CATEGORY_COORDINATE_OPERATION),
                    fmt::format("its projection EPSG:{} is not known", code));
  }
  const int number = keys.code(3075);
  if (number == 0) throw fault("its projection has no method (GeoKey 3075)");
  const double latitude = value_of(keys, Role::latitude, degrees, metres).value_or(0);
  const bool other =
      (number == 7 && keys.find(3078) != nullptr) || (number == 15 && std::abs(latitude) != 90);
  const auto* const method = std::find_if(
      kMethods.begin(), kMethods.end(),
      [&](const MethodOfKey& row) { return row.number == (other ? -number : number); });
  if (method == kMethods.end()) {
    for (const NamedMethod& row : kNamedMethods) {
      if (row.number == number) return conversion_by_name(row.name, keys, degrees, metres);
    }
    throw fault(fmt::format("its projection method {} (GeoKey 3075) is not known", number));
  }
  const auto is_role = [&](Role role) { return value_of(keys, role, degrees, metres); };
  std::vector<std::string> codes;
  std::vector<PJ_PARAM_DESCRIPTION> parameters;
  for (const int code : method->parameters) {
    if (code != 0) codes.push_back(fmt::format("{}", code));
  }
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const ParameterName& name = *parameter_of_code(method->parameters[i]);
    std::optional<double> value = is_role(name.role);
    // Polar systems store the latitude of true scale in the key for the latitude of origin. The
    // skew defaults to the azimuth.
    if (!value && name.code == 8832) value = latitude;
    if (!value && name.role == Role::skew) value = is_role(Role::azimuth);
    const ParameterKind kind = kind_of(name.role);
    parameters.push_back(
        {.name = name.name,
         .auth_name = "EPSG",
         .code = codes[i].c_str(),
         .value = value.value_or(kind == ParameterKind::scale ? 1 : 0),
         .unit_name = kind == ParameterKind::angle    ? "degree"
                      : kind == ParameterKind::length ? "metre"
                                                      : "unity",
         .unit_conv_factor = kind == ParameterKind::angle ? 0.017453292519943295 : 1,
         .unit_type = kind == ParameterKind::angle    ? PJ_UT_ANGULAR
                      : kind == ParameterKind::length ? PJ_UT_LINEAR
                                                      : PJ_UT_SCALE});
  }
  const std::string code = fmt::format("{}", method->code);
  return required(ProjObject(proj_create_conversion(
                      proj_context(), "unnamed", nullptr, nullptr, nullptr, "EPSG", code.c_str(),
                      static_cast<int>(parameters.size()), parameters.data())),
                  "its projection is impossible");
}

}  // namespace

CrsDefinition definition_of_geo_keys(const stream::Crs& crs) {
  const GeoKeyValues keys(crs);
  PJ_CONTEXT* const context = proj_context();
  const ProjObject base = base_of(keys);
  ProjObject complete;
  if (keys.code(1024) != 2) {
    const double metres = keys.metres_per_unit();
    if (metres == 0) throw fault("its linear unit is missing (GeoKey 3076)");
    const ProjObject conversion = conversion_of(keys, keys.degrees_per_unit(), metres);
    const ProjObject axes(proj_create_cartesian_2D_cs(context, PJ_CART2D_EASTING_NORTHING,
                                                      metres == 1 ? "metre" : "unknown", metres));
    std::string name = part_of(crs.name, "PCS Name");
    if (name.empty()) name = crs.name;
    complete = required(
        ProjObject(proj_create_projected_crs(context, name.empty() ? "unnamed" : name.c_str(),
                                             base.get(), conversion.get(), axes.get())),
        "its projection is impossible");
  }
  CrsDefinition definition = read_definition(complete != nullptr ? complete.get() : base.get());
  read_shift(keys, definition);
  settle_code(definition);
  return definition;
}

void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition) {
  const GeoKeyValues keys(crs);
  const auto contradiction = [&](const std::string& what) {
    return ContradictoryCrs(
        fmt::format("the GeoKeys contradict each other: EPSG:{} and {}", definition.epsg(), what),
        stream::message("say which is meant with {crs} EPSG:n"));
  };
  const int model = keys.code(1024), projected = keys.known_code(3072);
  if ((model == 1 && definition.geographic) || (model == 2 && !definition.geographic)) {
    throw contradiction(model == 1 ? "a projected model" : "a geographic model");
  }
  if (definition.geographic) {
    if (projected != 0) throw contradiction(fmt::format("the projected CRS EPSG:{}", projected));
    return;
  }
  const int base = keys.known_code(2048);
  if (base != 0 && definition.base_epsg != 0 && base != definition.base_epsg) {
    throw contradiction(fmt::format("the geographic CRS EPSG:{}", base));
  }
  const double unit = keys.metres_per_unit();
  if (unit != 0 && std::abs(unit / definition.metres_per_unit - 1) > 1e-9) {
    throw contradiction(fmt::format("the unit of {:f} metres", unit));
  }
  const bool parameters = std::any_of(kRoles.begin(), kRoles.end(), [&keys](const RoleOfKey& row) {
    return keys.number(row.key).has_value();
  });
  if (!parameters) return;
  const ProjObject crs_object = proj_crs_of_text(definition.wkt);
  const ProjObject conversion(proj_crs_get_coordoperation(proj_context(), crs_object.get()));
  const std::vector<ConversionParameter> meant = parameters_of(conversion.get());
  const double angle = keys.degrees_per_unit();
  const auto is_parallel = [](Role role) {
    return role == Role::parallel1 || role == Role::parallel2;
  };
  for (const RoleOfKey& row : kRoles) {
    const auto value = keys.number(row.key);
    if (!value) continue;
    const ParameterKind kind = kind_of(row.role);
    const double recorded = *value * (kind == ParameterKind::angle                 ? angle
                                      : kind == ParameterKind::length && unit != 0 ? unit
                                                                                   : 1.0);
    // Ignores keys that the method does not use. Two parallels may be in either order.
    bool known = false, good = false;
    for (const ConversionParameter& parameter : meant) {
      if (!parameter.role || (*parameter.role != row.role &&
                              !(is_parallel(*parameter.role) && is_parallel(row.role)))) {
        continue;
      }
      known = true;
      good = good || std::abs(recorded - parameter.value) <=
                         1e-8 * std::max({1.0, std::abs(recorded), std::abs(parameter.value)});
    }
    if (known && !good) {
      throw contradiction(fmt::format("GeoKey {} of {:f}", row.key, *value));
    }
  }
}

std::vector<stream::GeoKey> geo_keys_of(const CrsDefinition& definition) {
  const auto number = [](std::uint16_t key, double value) {
    return stream::GeoKey{.key = key, .values = {value}};
  };
  if (definition.geographic) {
    std::vector<stream::GeoKey> keys{
        number(1024, 2), number(2048, kUserDefined),
        stream::GeoKey{.key = 2049,
                       .text = "GCS Name = " + definition.name + "|Datum = " + definition.datum +
                               "|Ellipsoid = unnamed|Primem = " +
                               (definition.prime_meridian == 0 ? "Greenwich" : "unnamed") + "|"},
        number(2050, kUserDefined)};
    if (definition.prime_meridian != 0) keys.push_back(number(2051, kUserDefined));
    keys.push_back(number(2054, definition.degrees_per_unit == 1 ? 9102 : kUserDefined));
    if (definition.degrees_per_unit != 1) {
      keys.push_back(number(2055, definition.degrees_per_unit * base::kRadiansPerDegree));
    }
    keys.push_back(number(2056, kUserDefined));
    keys.push_back(number(2057, definition.ellipsoid.semi_major));
    if (definition.ellipsoid.inverse_flattening == 0) {
      keys.push_back(number(2058, definition.ellipsoid.semi_major));
    } else {
      keys.push_back(number(2059, definition.ellipsoid.inverse_flattening));
    }
    if (definition.prime_meridian != 0) keys.push_back(number(2061, definition.prime_meridian));
    if (definition.shift) {
      keys.push_back({.key = 2062, .values = {definition.shift->begin(), definition.shift->end()}});
    }
    return keys;
  }
  const ProjObject crs_object = proj_crs_of_text(definition.wkt);
  const std::array<const char*, 2> options{"MULTILINE=NO", nullptr};
  const auto written = [&](PJ_WKT_TYPE type) {
    return crs_object != nullptr
               ? text_of(proj_as_wkt(proj_context(), crs_object.get(), type, options.data()))
               : std::string();
  };
  std::string wkt = written(PJ_WKT1_ESRI);
  // ESRI's form has no axes and does not support the parameters of every method.
  if (wkt.empty() || !mean_the_same(wkt, definition.wkt)) wkt = definition.wkt;
  // GDAL looks for this citation if the model is user-defined.
  return {number(1024, kUserDefined), number(3072, kUserDefined),
          stream::GeoKey{.key = 3073, .text = "ESRI PE String = " + wkt}};
}

}  // namespace terrace::terrain
