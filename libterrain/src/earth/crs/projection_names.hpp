// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "earth/crs/proj_object.hpp"

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

/// Whether a method or parameter is that of the table: by its code if EPSG's is given, otherwise by
/// its name.
bool is_called(int code, const char* name, const char* authority, const char* id,
               const char* called);

/// A parameter of a conversion, in degrees, metres or as a factor. role: nullopt if the table has
/// neither its code nor its name.
struct ConversionParameter {
  std::optional<ParameterRole> role;
  double value = 0;
};
std::vector<ConversionParameter> parameters_of(const PJ* conversion);

/// Lower case, letters and digits only: the form in which names are compared.
std::string plain_name(std::string_view name);

/// Clean a factor to degrees or metres of the rounding in texts: 0.0174532925199433 radians become
/// exactly one degree.
double degrees_of(double radians);
double metres_of(double metres);

}  // namespace terrace::terrain
