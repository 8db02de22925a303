// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "earth/crs/proj_object.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// An operation from PROJ's database between two systems.
struct OperationChoice {
  bool found = false;
  std::string name;
  double accuracy = -1;  ///< in metres; negative: unknown
  std::string pipeline;  ///< x before y
  /// A more accurate operation that lacks a grid: "\"...\" within 1 m lacks the grid ..."; or
  /// empty.
  std::string better;
};

/// Returns the best operation with installed grids for an area. Prefers the operation that is valid
/// in the largest part of the area, then the most accurate one. Operations that ignore a difference
/// between the systems ("ballpark") are never used. area: by default, the area where both systems
/// are used. Data outside all areas of use get the operation for the whole system.
OperationChoice choose_operation(const PJ* from, const PJ* to,
                                 const std::optional<GeographicArea>& area);

/// Returns "\"name\" within 2 m", without the accuracy if it is unknown or 0.
std::string quoted_with_accuracy(const std::string& name, double accuracy);

}  // namespace terrace::terrain
