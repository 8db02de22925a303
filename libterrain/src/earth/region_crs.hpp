// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Converts a region from the target CRS of `change` to its source CRS. Its outline, also that of a
/// box, gets as many additional corners as it needs to be within a millionth of its length of the
/// true curve. Heights do not change. In degrees, longitudes may exceed 180 to cross the
/// antimeridian (170 to 190). The region is shifted by full turns to `bounds`, a box in the
/// result's CRS. Throws: stream::Error if the outline leaves the area of that CRS, or is
/// discontinuous in it.
Region region_in(const Region& region, const Transformation& change, const stream::Box3& bounds);

/// Returns the region shifted by whole turns to `bounds`. The result has several parts if the
/// region meets both ends of the data. The region is unchanged if no shift meets them, or if it is
/// a box wider than two turns, such as an infinite one. turn: 0 if x does not go around the earth.
/// A box is widened by the tolerance on each side; its extent() is not.
Region with_turns(const Region& region, double turn, const stream::Box3& bounds,
                  const Point2& tolerance = {});

/// Returns the middle of a box in the target CRS of `change`; NaN if it has no image there.
Point2 middle_in(const Transformation& change, const stream::Box3& box);

}  // namespace terrace::terrain
