// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// A region given in the CRS that `change` leads to as one in that it comes from: its outline, a
/// box's too, with so many corners between its own that it runs within a millionth of its length of
/// the true curve. Heights stay as they are. In degrees, longitudes may go beyond 180 to cross the
/// antimeridian (170 to 190); the part that is meant is moved by full turns to where `bounds`, a
/// box in the result's CRS, lies. Throws: stream::Error if the outline leaves the places that that
/// CRS shows, or is torn there.
Region region_in(const Region& region, const Transformation& change, const stream::Box3& bounds);

/// The region whole turns away, where `bounds` lies: more than one part if both ends of the data
/// do; where it is if none does, or if it is a box wider than two turns, as infinite ones are.
/// turn: 0 if x does not lead around. A box is made wider by the tolerance on each side; its
/// extent() is not.
Region with_turns(const Region& region, double turn, const stream::Box3& bounds,
                  const Point2& tolerance = {});

/// The middle of a box in the CRS that `change` leads to; NaN if it has no place there.
Point2 middle_in(const Transformation& change, const stream::Box3& box);

}  // namespace terrace::terrain
