// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "earth/crs/proj_object.hpp"

namespace terrace::terrain {

/// The role of a projection parameter. Methods give the same role different names.
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

/// True if PROJ's method or parameter (authority, id, called) is the EPSG entry (code, name).
/// Compares codes if the authority is EPSG and there is an id, otherwise names with plain_name().
bool is_called(int code, const char* name, const char* authority, const char* id,
               const char* called);

/// A parameter of a conversion. `value` is in degrees, in metres or a scale factor. `role` is
/// nullopt if neither its code nor its name is known.
struct ConversionParameter {
  std::optional<ParameterRole> role;
  double value = 0;
};
std::vector<ConversionParameter> parameters_of(const PJ* conversion);

/// Lower case, letters and digits only: the form in which names are compared.
std::string plain_name(std::string_view name);

/// Convert the size of a unit and undo the rounding in texts of CRSs: 0.0174532925199433 radians
/// give exactly one degree.
double degrees_of(double radians);
double metres_of(double metres);

}  // namespace terrace::terrain
