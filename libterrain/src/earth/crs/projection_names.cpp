// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/projection_names.hpp"

#include <array>
#include <cmath>
#include <cstdlib>

#include <terrace/base/portable_math.hpp>

namespace terrace::terrain {
namespace {

using Role = ParameterRole;

constexpr std::array<ParameterName, 20> kParameters{{
    {8801, Role::latitude, "Latitude of natural origin"},
    {8802, Role::longitude, "Longitude of natural origin"},
    {8805, Role::scale, "Scale factor at natural origin"},
    {8806, Role::false_easting, "False easting"},
    {8807, Role::false_northing, "False northing"},
    {8811, Role::latitude, "Latitude of projection centre"},
    {8812, Role::longitude, "Longitude of projection centre"},
    {8813, Role::azimuth, "Azimuth of initial line"},
    {8814, Role::skew, "Angle from Rectified to Skew Grid"},
    {8815, Role::scale, "Scale factor on initial line"},
    {8816, Role::false_easting, "Easting at projection centre"},
    {8817, Role::false_northing, "Northing at projection centre"},
    {8821, Role::latitude, "Latitude of false origin"},
    {8822, Role::longitude, "Longitude of false origin"},
    {8823, Role::parallel1, "Latitude of 1st standard parallel"},
    {8824, Role::parallel2, "Latitude of 2nd standard parallel"},
    {8826, Role::false_easting, "Easting at false origin"},
    {8827, Role::false_northing, "Northing at false origin"},
    {8832, Role::parallel1, "Latitude of standard parallel"},
    {8833, Role::longitude, "Longitude of origin"},
}};

}  // namespace

bool is_called(int code, const char* name, const char* authority, const char* id,
               const char* called) {
  if (text_of(authority) == "EPSG" && id != nullptr) return std::atoi(id) == code;
  return called != nullptr && plain_name(called) == plain_name(name);
}

const ParameterName* parameter_of_code(int code) {
  for (const ParameterName& row : kParameters) {
    if (row.code == code) return &row;
  }
  return nullptr;
}

ParameterKind kind_of(ParameterRole role) {
  if (role == Role::scale) return ParameterKind::scale;
  return role == Role::false_easting || role == Role::false_northing ? ParameterKind::length
                                                                     : ParameterKind::angle;
}

std::vector<ConversionParameter> parameters_of(const PJ* conversion) {
  PJ_CONTEXT* const context = proj_context();
  std::vector<ConversionParameter> found;
  const int count = proj_coordoperation_get_param_count(context, conversion);
  for (int i = 0; i < count; ++i) {
    const char *name = nullptr, *authority = nullptr, *code = nullptr, *category = nullptr;
    double value = 0, unit = 1;
    proj_coordoperation_get_param(context, conversion, i, &name, &authority, &code, &value, nullptr,
                                  &unit, nullptr, nullptr, nullptr, &category);
    ConversionParameter parameter;
    for (const ParameterName& row : kParameters) {
      if (is_called(row.code, row.name, authority, code, name)) parameter.role = row.role;
    }
    const std::string kind = text_of(category);
    parameter.value = value * (kind == "angular"  ? degrees_of(unit)
                               : kind == "linear" ? metres_of(unit)
                                                  : unit);
    found.push_back(parameter);
  }
  return found;
}

std::string plain_name(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') {
      plain += static_cast<char>(c + 32);
    } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      plain += c;
    }
  }
  return plain;
}

double degrees_of(double radians) {
  const double degrees = radians / base::kRadiansPerDegree;
  for (const double exact : {1.0, 0.9, 1.0 / 60, 1.0 / 3600}) {
    if (std::abs(degrees / exact - 1) < 1e-9) return exact;
  }
  return degrees;
}

double metres_of(double metres) {
  constexpr double kSurveyFoot = 0.30480060960121924;
  return std::abs(metres / kSurveyFoot - 1) < 1e-9 ? kSurveyFoot : metres;
}

}  // namespace terrace::terrain
