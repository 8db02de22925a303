// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "earth/crs/proj_object.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// An operation of PROJ's database between two systems.
struct OperationChoice {
  bool found = false;
  std::string name;
  double accuracy = -1;  ///< metres; negative: unknown
  std::string pipeline;  ///< x before y
  /// A more accurate one that lacks a grid: "\"...\" within 1 m lacks the grid ..."; else empty.
  std::string better;
};

/// The best whose grids are installed, for a whole area: what is meant for most of it, then the
/// most accurate. Operations that ignore a difference between the systems ("ballpark") are never
/// taken. area: without it, where both systems are used. Data beyond all areas of use get what is
/// meant for the whole system.
OperationChoice choose_operation(const PJ* from, const PJ* to,
                                 const std::optional<GeographicArea>& area);

/// "\"name\" within 2 m", without the accuracy if it is not known or 0.
std::string quoted_with_accuracy(const std::string& name, double accuracy);

}  // namespace terrace::terrain
