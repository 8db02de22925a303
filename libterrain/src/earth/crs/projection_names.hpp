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

/// What a parameter means, whatever the method calls it.
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
/// nullptr if there is none.
const ParameterName* parameter_of_code(int code);
ParameterKind kind_of(ParameterRole role);

/// A parameter of a conversion: degrees, metres or a factor. role: none if it has no code or name
/// of the table.
struct ConversionParameter {
  std::optional<ParameterRole> role;
  double value = 0;
};
std::vector<ConversionParameter> parameters_of(const PJ* conversion);

/// The method of a conversion as GeographicLib has it, with its parameters; nothing if it is not
/// one of them.
struct KnownProjection {
  ProjectionMethod method;
  ProjectionParameters parameters;
};
std::optional<KnownProjection> known_projection(const PJ* conversion);

/// Lower case, letters and digits only: how names are compared.
std::string plain_name(std::string_view name);

/// A factor to degrees or metres, cleaned of what rounded texts leave: 0.0174532925199433 radians
/// stand for a degree.
double degrees_of(double radians);
double metres_of(double metres);

}  // namespace terrace::terrain
