// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "terrace/stream/schema.hpp"

/// The georeference assumed for a raster without one.

namespace terrace::stream {

/// Cells of 1 x 1 with y = -row.
inline constexpr WorldTransform kPlainWorld{{1, 0, 0, 0, -1, 0}};
/// The corresponding comment.
inline const std::string kNoGeoreferencing =
    "no georeferencing: a plain grid with cells of 1 x 1, y = -row";

}  // namespace terrace::stream
