// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "terrace/tri/interpolation.hpp"

/// The exact tests that Delaunay2<double> is made with, for programs that find single triangles of
/// a set of points without triangulating it. Some nanoseconds each; ties and near ties, which are
/// decided by exact numbers, up to a microsecond.

namespace terrace::tri {

/// 1, 0 or -1: c lies left of, on, or right of the directed line from a to b. Requires finite
/// coordinates, which may have any size.
[[nodiscard]] int orientation(const Point2& a, const Point2& b, const Point2& c);

/// Whether p lies inside the circle through a, b and c, which are counter-clockwise. Of cocircular
/// points the lexicographically larger counts as raised, as in Delaunay2: so a triangle is one of
/// the triangulation if and only if no point lies inside its circle. False for a, b and c
/// themselves. Requires finite coordinates.
[[nodiscard]] bool inside_circle(const Point2& a, const Point2& b, const Point2& c,
                                 const Point2& p);

/// -1, 0 or 1: a is nearer to p than b, as near, or farther. Requires finite coordinates.
[[nodiscard]] int compare_distance(const Point2& p, const Point2& a, const Point2& b);

}  // namespace terrace::tri
