// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/shape.hpp"

/// Surfaces with fewer vertices that stay within a distance of the full surface.

namespace terrace::tri {

struct SimplificationOptions {
  /// The largest allowed distance between the full surface and the simplified one, in the unit of
  /// the coordinates. Not negative.
  double max_error = std::numeric_limits<double>::infinity();
  /// Stops as soon as the surface has at most this many vertices, even if more could be removed.
  std::size_t max_points = 0;
  base::StopCheck check_stop = {};
};

struct SimplifiedSurface {
  Surface surface;
  /// The index in the full surface of each vertex, ascending.
  std::vector<std::uint32_t> input;
  /// An upper bound of the distance of every vertex of the full surface from the simplified one,
  /// and of nine places or more on each triangle, about as many as it stands for vertices, from the
  /// full surface.
  double max_distance = 0.0;
};

/// Removes vertices of a surface by collapsing edges. A vertex moves onto a neighbour, so all
/// vertices of the result are vertices of the surface. Candidates are ordered by the squared
/// distances from the planes of the triangles that a vertex stands for (M. Garland, P. Heckbert,
/// doi:10.1145/258734.258849), and then by the error itself, which is measured in both directions.
/// A removed vertex is kept with the triangle nearest to it, and its distance is measured each time
/// that triangle changes. A collapse that exceeds the bound is refused.
///
/// A collapse is also refused if it turns a triangle by more than 78 degrees, closes or opens a
/// hole, cuts off a part, or creates an edge with three triangles. So the parts, their handles and
/// openings remain, and a closed surface remains closed. Vertices on edges with three or more
/// triangles are not removed, and those on the border stay near it. The volume of a convex body
/// shrinks, because the vertices are on its surface.
///
/// Vertices without a triangle are left out and have no distance. Equal positions with different
/// indices are different vertices.
///
/// The result is a function of the surface and the limits. Cost: O(n log n) for n vertices, 100 to
/// 200 us for each. Memory: about 400 bytes per vertex.
///
/// Throws std::invalid_argument for a face with a corner that is not the index of a point or with
/// two equal corners, a point that is not finite, more than 1.4 thousand million faces, and a
/// bound that is negative or NaN.
SimplifiedSurface simplify_surface(const Surface& surface, const SimplificationOptions& options);

}  // namespace terrace::tri
