// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/tri/surface.hpp"

/// CGAL's reconstructions, each in a translation unit of its own: they take long to compile.

namespace terrace::tri::reconstruct {

using Face = std::array<std::uint32_t, 3>;

/// Faces between the points, which are different and not all in one plane.
std::vector<Face> advancing_front(std::span<const Point3> points, double radius_ratio_bound,
                                  double beta);

/// alpha, offset > 0; at least one point.
Surface alpha_wrap(std::span<const Point3> points, double alpha, double offset);

}  // namespace terrace::tri::reconstruct
