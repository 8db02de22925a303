// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Surfaces of triangles and their measures.

namespace terrace::tri {

using Point3 = std::array<double, 3>;

struct Surface {
  std::vector<Point3> points;
  /// Numbers of points, counter-clockwise seen from outside.
  std::vector<std::array<std::uint32_t, 3>> faces;
};

struct SurfaceMeasures {
  std::size_t faces = 0;
  std::size_t vertices = 0;  ///< points that are in a face
  std::size_t edges = 0;
  double area = 0.0;
  /// Enclosed by the faces, by the divergence theorem; where the surface is not closed it depends
  /// on where the openings are.
  double volume = 0.0;
  /// Sets of faces connected by edges.
  std::size_t components = 0;
  /// vertices - edges + faces. 2 for a sphere, 2 - 2g for a closed surface with g handles; each
  /// vertex or edge where a surface touches itself takes away from that.
  std::int64_t euler_characteristic = 0;
  std::size_t border_edges = 0;        ///< in one face
  std::size_t non_manifold_edges = 0;  ///< in three or more
  /// Every edge is in as many faces one way as the other.
  bool closed = true;
};

/// O(n log n). Sums are in the order of the faces. Faces with two equal corners are not allowed.
/// Throws std::invalid_argument naming the face whose corner is not the number of a point, or two
/// of whose corners are the same.
SurfaceMeasures measure(const Surface& surface);

}  // namespace terrace::tri
