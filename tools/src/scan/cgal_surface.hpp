// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include <terrace/base/stop_check.hpp>
#include <terrace/tri/shape.hpp>

/// Surfaces of points by CGAL's packages, which are GPL-3.0-or-later: the command's alone.

namespace terrace::tools {

/// CGAL's advancing front (D. Cohen-Steiner, F. Da, doi:10.1007/s00371-003-0217-z): smooth where
/// samples are dense, manifold, open where there are none. May leave out points. Components are
/// turned so that their volume is positive. CGAL 5.5 breaks ties of equal radii by addresses in
/// memory, so single faces can differ from run to run. No faces where all points are in one plane.
///
/// Throws std::invalid_argument as alpha_wrap_surface(), and what check_stop throws; it is not
/// heard while CGAL triangulates. About 2 s per 100,000 points.
tri::RestoredSurface advancing_front_surface(std::span<const tri::Point3> points,
                                             const base::StopCheck& check_stop = {});

/// CGAL's alpha wrap (C. Portaneri et al., doi:10.1145/3528223.3530152): watertight, manifold, free
/// of intersections, and strictly around all points at a distance of alpha / 30. Its corners are
/// new points. Openings up to about the radius `alpha` (in the points' unit) are closed; larger
/// ones let the wrap inside. 0: the larger of d / 20 and 4 d / sqrt(n), d the diagonal of the
/// points' box; no faces then where all points are equal.
///
/// Throws std::invalid_argument naming the index of a point that is not finite or beyond 1e100 in
/// size, and where the points' box is smaller than 1e-100 but not a point: CGAL constructs points
/// in doubles.
tri::Surface alpha_wrap_surface(std::span<const tri::Point3> points, double alpha = 0.0);

}  // namespace terrace::tools
