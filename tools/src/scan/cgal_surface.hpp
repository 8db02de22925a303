// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/tri/shape.hpp>

/// Surfaces of points by CGAL's packages. These are GPL-3.0-or-later, so only the command uses
/// them.

namespace terrace::tools {

/// Runs CGAL's advancing front (D. Cohen-Steiner, F. Da, doi:10.1007/s00371-003-0217-z). The
/// surface is smooth where samples are dense, manifold, and open where there are none. It may leave
/// out points. Components are oriented so that their volume is positive. CGAL 5.5 breaks ties of
/// equal radii by memory address, so single faces can differ between runs. Returns no faces if all
/// points are in one plane.
///
/// Throws std::invalid_argument as alpha_wrap_surface() does, and what check_stop throws;
/// check_stop is not called while CGAL triangulates. About 2 s per 100,000 points.
tri::RestoredSurface advancing_front_surface(std::span<const tri::Point3> points,
                                             const base::StopCheck& check_stop = {});

/// Runs CGAL's alpha wrap (C. Portaneri et al., doi:10.1145/3528223.3530152). The surface is
/// watertight, manifold, free of self-intersections, and strictly encloses all points at a distance
/// of alpha / 30. Its corners are new points. It closes openings up to a radius of about `alpha`
/// (in the points' unit); larger ones let the wrap inside. An alpha of 0 means the larger of d / 20
/// and 4 d / sqrt(n), where d is the diagonal of the points' bounding box; the result then has no
/// faces if all points are equal.
///
/// Throws std::invalid_argument, which names the index of a point that is not finite or beyond
/// 1e100 in size. Also throws if the bounding box is smaller than 1e-100 but not a point, because
/// CGAL constructs points in doubles.
tri::Surface alpha_wrap_surface(std::span<const tri::Point3> points, double alpha = 0.0);

// CGAL's own functions, each in a separate translation unit because they take long to compile.

/// Returns faces between distinct points that are not all in one plane, with CGAL's defaults: a
/// radius ratio bound of 5 and a beta of 0.52 radians. Calls check_stop for each candidate facet.
std::vector<std::array<std::uint32_t, 3>> advancing_front(std::span<const tri::Point3> points,
                                                          const base::StopCheck& check_stop);

/// Requires alpha > 0, offset > 0 and at least one point.
tri::Surface alpha_wrap(std::span<const tri::Point3> points, double alpha, double offset);

}  // namespace terrace::tools
