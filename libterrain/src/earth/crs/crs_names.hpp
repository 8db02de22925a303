// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "earth/crs/projection.hpp"

/// The names and codes under which files know projections and their parameters.

namespace terrace::terrain {

/// A parameter: which member it is, what kind of number, and EPSG's name and code of it.
struct ParameterName {
  double ProjectionParameters::*member;
  enum class Kind { angle, length, scale } kind;
  const char* name;
  int code;
};

struct MethodName {
  ProjectionMethod method;
  const char* name;  ///< EPSG's
  int code;
  std::span<const ParameterName> parameters;
};

const MethodName& method_name(ProjectionMethod method);

/// The method of an EPSG code; nothing if there is none.
std::optional<ProjectionMethod> method_of_epsg(int code);

/// The method of a name in WKT of any dialect. What names leave open (Lambert conformal with one or
/// two parallels, polar stereographic with scale or with true latitude) the parameters decide:
/// has_second: a second parallel is given; latitude: of the origin.
std::optional<ProjectionMethod> method_of_name(std::string_view name, bool has_first,
                                               bool has_second, double latitude);

/// The member that a parameter of that name in WKT of any dialect sets; nullptr if there is none.
const ParameterName* parameter_of_name(std::string_view name);

}  // namespace terrace::terrain
