// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Whether the triangle, seen from above, has a point in common with the region; with a region of
/// bounded heights also whether its height range has. Exact but for overflow, see orientation().
bool touches(const Region& region, const std::array<stream::Point3, 3>& triangle);

}  // namespace terrace::terrain
