// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace terrace::stream {

/// How directly a column's name says what it is. A table that has names of several kinds means the
/// first of them.
enum class AxisNameKind : std::uint8_t {
  letter,        ///< "x"
  word,          ///< "easting", "lon", "height"
  with_letter,   ///< "POINT_X", "x_coord", "X [m]"
  abbreviation,  ///< "E", "N"
};
inline constexpr std::size_t kAxisNameKinds = 4;

/// The coordinate that a column's name says.
struct AxisName {
  std::size_t axis = 0;  ///< 0 to 2
  AxisNameKind kind = AxisNameKind::letter;
  bool angle = false;  ///< a longitude or latitude
};

/// Case and units ("Easting(m)", "z_ft") do not matter; see axis_unit(). nullopt if the name is not
/// that of a coordinate.
std::optional<AxisName> axis_named(std::string_view name);

/// The unit that such a name has in brackets or as its last words, as canonical_unit() gives it, or
/// "degree": "Z (ft)", "height [m a.s.l.]", "elev_us_ft". What is in brackets and begins with no
/// unit as it is; empty without brackets and unit.
std::string axis_unit(std::string_view name);

}  // namespace terrace::stream
