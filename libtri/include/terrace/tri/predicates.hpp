// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "terrace/tri/interpolation.hpp"

/// The exact tests on which Delaunay2<double> is built, for programs that find single triangles of
/// a set of points without triangulating it. They take some nanoseconds each. Ties and near ties,
/// which exact numbers decide, take up to a microsecond.

namespace terrace::tri {

/// Returns 1, 0 or -1 if c is left of, on, or right of the directed line from a to b. Requires
/// finite coordinates of any size.
[[nodiscard]] int orientation(const Point2& a, const Point2& b, const Point2& c);

/// Returns true if p is inside the circle through a, b and c, which are counter-clockwise.
/// Lexicographically larger points count as raised among cocircular ones, as in Delaunay2, so a
/// triangle belongs to the triangulation if and only if no point is inside its circle. False for a,
/// b and c themselves. Requires finite coordinates.
[[nodiscard]] bool inside_circle(const Point2& a, const Point2& b, const Point2& c,
                                 const Point2& p);

/// Returns -1, 0 or 1 if a is nearer to p than b, as near, or farther. Requires finite coordinates.
[[nodiscard]] int compare_distance(const Point2& p, const Point2& a, const Point2& b);

}  // namespace terrace::tri
