// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <span>

#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/region.hpp"

/// The linear surface on triangles of points. The same points give the same bits, in any order.

namespace terrace::terrain {

/// A point of a surface.
struct SurfaceCorner {
  Point2 place;
  double height = 0;
};
using SurfaceTriangle = std::array<SurfaceCorner, 3>;  ///< counter-clockwise

/// Whether an edge between two places is too long for its triangles to be part of the surface.
using TooLong = std::function<bool(const Point2&, const Point2&)>;

/// Returns the surface inside a triangle or on its border.
SurfacePoint on_plane(SurfaceTriangle triangle, const Point2& place);
/// Returns the height on an edge.
double on_edge(SurfaceCorner a, SurfaceCorner b, const Point2& place);
/// Returns the surface at a place where triangles meet, with the given height. The gradient is the
/// mean over the triangles whose edges are not too long. Reorders the triangles.
SurfacePoint where_triangles_meet(const Point2& place, double height,
                                  std::span<SurfaceTriangle> triangles, const TooLong& too_long);

inline bool is_surface(const SurfaceTriangle& t, const TooLong& too_long) {
  return !too_long || (!too_long(t[0].place, t[1].place) && !too_long(t[1].place, t[2].place) &&
                       !too_long(t[2].place, t[0].place));
}

}  // namespace terrace::terrain
