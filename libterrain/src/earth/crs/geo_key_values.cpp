// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/geo_key_values.hpp"

#include <cmath>

#include "base/portable_math.hpp"
#include "earth/crs/crs_definition.hpp"

namespace terrace::terrain {
namespace {

using P = ProjectionParameters;
using Kind = KeyOfParameter::Kind;

}  // namespace

const std::array<KeyOfParameter, 19> kParameterKeys{{
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

void fail_geo_keys(const std::string& cause) {
  throw CrsError(cause, "name the system by its code: --crs EPSG:n");
}

const stream::GeoKey* GeoKeyValues::find(int key) const {
  for (const stream::GeoKey& candidate : crs_.geo_keys) {
    if (candidate.key == key) return &candidate;
  }
  return nullptr;
}

std::optional<double> GeoKeyValues::number(int key) const {
  const stream::GeoKey* const found = find(key);
  if (found == nullptr || found->values.empty()) return std::nullopt;
  if (!std::isfinite(found->values.front())) {
    fail_geo_keys("GeoKey " + std::to_string(key) + " is not finite");
  }
  return found->values.front();
}

int GeoKeyValues::code(int key) const {
  const double value = number(key).value_or(0);
  if (!(value >= 0 && value <= 65535 && value == std::floor(value))) {
    fail_geo_keys("GeoKey " + std::to_string(key) + " is not a code");
  }
  return static_cast<int>(value);
}

std::string GeoKeyValues::text(int key) const {
  const stream::GeoKey* const found = find(key);
  return found == nullptr ? std::string() : found->text;
}

double GeoKeyValues::degrees_per_unit() const {
  switch (const int unit = code(2054)) {
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
      if (const auto size = number(2055); size && *size > 0) return *size / kDegree;
      fail_geo_keys("its angular unit is user-defined and has no size (GeoKey 2055)");
    default:
      fail_geo_keys("its angular unit EPSG:" + std::to_string(unit) + " is not known");
  }
}

double GeoKeyValues::metres_per_unit() const {
  switch (const int unit = code(3076)) {
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
      if (const auto size = number(3077); size && *size > 0) return *size;
      fail_geo_keys("its linear unit is user-defined and has no size (GeoKey 3077)");
    case 0:
      return 0;
    default:
      fail_geo_keys("its linear unit EPSG:" + std::to_string(unit) + " is not known");
  }
}

}  // namespace terrace::terrain
