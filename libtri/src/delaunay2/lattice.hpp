// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "mesh.hpp"

/// Points that are neighbours on the integer lattice, such as the cells of a raster. Where the
/// surroundings are complete, the triangulation is known without a search.

namespace terrace::tri::planar {

/// Finds the points whose eight lattice neighbours will all be inserted too; `head`, an existing
/// vertex or kNone, counts as inserted. Fills lattice.inside with these points and lattice.outside
/// with the others. Returns false if there are too few inside to be worth it. O(points).
template <class Kernel>
bool find_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                  std::uint32_t head);

/// Inserts the points inside. The others must already have been inserted, with their vertices in
/// lattice.vertex. Fills lattice.inserted.
///
/// The circle around a lattice edge of length 1 contains no lattice point, so such an edge between
/// two vertices is always an edge of the triangulation. A square of four of them is therefore
/// always two triangles, with the diagonal of build_grid(). The squares around the points inside
/// are cut out along existing edges and rewritten; all other triangles stay. O(points).
template <class Kernel>
void fill_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points);

}  // namespace terrace::tri::planar
