// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "earth/crs/proj_object.hpp"
#include "earth/crs/projection.hpp"

namespace terrace::terrain {

/// The meaning of a parameter, whatever the method calls it.
enum class ParameterRole : std::uint8_t {
  latitude,
  longitude,
  scale,
  false_easting,
  false_northing,
  parallel1,
  parallel2,
  azimuth,
  skew,
};
enum class ParameterKind : std::uint8_t { angle, length, scale };

/// A parameter of the EPSG dataset.
struct ParameterName {
  int code;
  ParameterRole role;
  const char* name;
};
/// Returns nullptr for an unknown code.
const ParameterName* parameter_of_code(int code);
ParameterKind kind_of(ParameterRole role);

/// A parameter of a conversion, in degrees, metres or as a factor. role: nullopt if the table has
/// neither its code nor its name.
struct ConversionParameter {
  std::optional<ParameterRole> role;
  double value = 0;
};
std::vector<ConversionParameter> parameters_of(const PJ* conversion);

/// The method of a conversion and its parameters, if GeographicLib supports it; nullopt otherwise.
struct KnownProjection {
  ProjectionMethod method;
  ProjectionParameters parameters;
};
std::optional<KnownProjection> known_projection(const PJ* conversion);

/// Lower case, letters and digits only: the form in which names are compared.
std::string plain_name(std::string_view name);

/// Clean a factor to degrees or metres of the rounding in texts: 0.0174532925199433 radians become
/// exactly one degree.
double degrees_of(double radians);
double metres_of(double metres);

}  // namespace terrace::terrain
