// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace terrace::stream {

/// The kinds of column names for coordinates. If several columns of a table name the same
/// coordinate, the kind listed first takes precedence.
enum class AxisNameKind : std::uint8_t {
  letter,        ///< "x"
  word,          ///< "easting", "lon", "height"
  with_letter,   ///< "POINT_X", "x_coord", "X [m]"
  abbreviation,  ///< "E", "N"
};
inline constexpr std::size_t kAxisNameKinds = 4;

/// The coordinate that a column's name stands for.
struct AxisName {
  std::size_t axis = 0;  ///< 0 to 2
  AxisNameKind kind = AxisNameKind::letter;
  bool angle = false;  ///< a longitude or latitude
};

/// Returns the coordinate that a column of this name holds; nullopt if it is not a coordinate.
/// Ignores case and units ("Easting(m)", "z_ft"); see axis_unit().
std::optional<AxisName> axis_named(std::string_view name);

/// Returns the unit that such a name has in brackets or as its last words ("Z (ft)", "height
/// [m a.s.l.]", "elev_us_ft"): a name that canonical_unit() returns, or "degree". Returns a text in
/// brackets that does not begin with a unit unchanged; empty if there are no brackets and no unit.
std::string axis_unit(std::string_view name);

}  // namespace terrace::stream
