// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Adds to each height, to within `tolerance`, what exact(places, heights) would add. The offsets
/// must be smooth except along some lines, as geoids are along the lines of their grids. Uses
/// polynomials of fifth degree in boxes around places, checked as in GeographyPatch; a box where
/// these are not accurate enough is quartered, along common grid lines. NaN heights stay NaN. Sizes
/// must be equal. The same places give the same heights; a place among other places may get a
/// height that differs by the tolerance. 66 to 240 million heights per second and core for EGM96 at
/// neighbouring places, 4 million one by one (tests/bench/geography_bench).
void add_smooth_offsets(
    std::span<const Point2> places, std::span<double> heights, double tolerance,
    const std::function<void(std::span<const Point2>, std::span<double>)>& exact);

}  // namespace terrace::terrain
