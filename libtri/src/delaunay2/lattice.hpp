// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "mesh.hpp"

/// Points that lie side by side on the integer lattice, as the cells of a raster do. Where all
/// around is complete, the triangulation is known without a search.

namespace terrace::tri::planar {

/// Finds the points of which all eight lattice neighbours are to be inserted too; `head`, a living
/// vertex or kNone, counts as one of these. Fills lattice.inside with them and lattice.outside with
/// the others. Returns false if there are too few of them to be worth it. O(points).
template <class Kernel>
bool find_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                  std::uint32_t head);

/// Inserts those inside; the others must have been inserted, and their vertices be in
/// lattice.vertex. Fills lattice.inserted.
///
/// The circle around a lattice edge of length 1 has no lattice point in it: such an edge between
/// two vertices is always an edge of the triangulation, and a square of four of them is always two
/// triangles, with the diagonal of build_grid(). So the squares around the points inside are cut
/// out along edges that are there, and written anew; all else stays. O(points).
template <class Kernel>
void fill_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points);

}  // namespace terrace::tri::planar
