// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <type_traits>

#include <terrace/base/stop_check.hpp>

#include "curve_sort.hpp"
#include "mesh.hpp"

namespace terrace::tri::planar {

/// Cost of the walk to a point, see base::StopTicks.
inline constexpr std::size_t kTicksOfWalk = 256;

/// Joins a vertex, which has its slot and point but no triangle, to a triangulation with triangles.
/// `conflict`: a triangle in conflict with it, as found by walk() if no corner equals the point.
///
/// Traverses the cavity of Bowyer and Watson depth-first across edges. The cavity contains no
/// vertex, so the traversal is a tree and needs no marks. It meets the cavity's boundary in
/// counter-clockwise order, so each new triangle is linked to the previous one. About 4.2 triangles
/// are replaced.
template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict);

/// Inserts a point, or finds the vertex that equals it. `hint`: an existing vertex, or kNone.
template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);

/// Points that are neighbours on the integer lattice, such as the cells of a raster, have known
/// triangles wherever their surroundings are complete. The next two functions use that.

/// Finds the points whose eight lattice neighbours will all be inserted too. `head`, an existing
/// vertex or kNone, counts as inserted. Fills lattice.inner_points with these points and
/// lattice.outer_points with the others. Returns false if there are too few inside to be worth it.
/// O(points).
template <class Kernel>
bool find_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                  std::uint32_t head);

/// Inserts the points inside. The others must already have been inserted, with their vertices in
/// lattice.vertex. Fills lattice.inserted.
///
/// The circle around a lattice edge of length 1 contains no lattice point, so such an edge between
/// two vertices is always an edge of the triangulation. A square of four of them is therefore
/// always two triangles, with the diagonal of build_grid(). Both hold in the metric Windowed too,
/// because such an edge or square is in one window. The squares around the points inside are cut
/// out along existing edges and rewritten. All other triangles stay. O(points).
template <class Kernel>
void fill_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points);

/// One point in each group of this size is inserted first.
inline constexpr std::uint32_t kSampleEvery = 8;

/// insert_points() for the points that find_lattice() has found.
template <class Kernel, class Done>
void insert_on_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                       std::uint32_t hint, Done done) {
  Lattice& lattice = mesh.lattice;
  const auto insert = [&](std::uint32_t i) {
    const std::size_t node = lattice.node(points[i]);
    hint = lattice.neighbour(node, hint);
    const Inserted inserted = insert_point(mesh, points[i], hint);
    hint = lattice.vertex[node] = inserted.vertex;
    done(i, inserted);
  };
  const std::vector<std::uint32_t>& outside = lattice.outer_points;
  for (std::size_t k = 0; k < outside.size(); k += kSampleEvery) insert(outside[k]);
  for (std::size_t k = 0; k < outside.size(); ++k)
    if (k % kSampleEvery != 0) insert(outside[k]);
  fill_lattice(mesh, points);
  for (std::size_t k = 0; k < lattice.inner_points.size(); ++k) {
    done(lattice.inner_points[k], lattice.inserted[k]);
  }
}

/// Inserts points in an order that it chooses. Calls done(number, inserted) for each. `hint`: a
/// vertex near the points. For a cluster this is its head.
///
/// The hint of a point is the previous one on a Hilbert curve. As in bulk construction, a coarse
/// sample goes first, which saves a quarter of the temporary triangles. Integer points with all
/// eight lattice neighbours go last and together, see fill_lattice(). The hint of the others is a
/// lattice neighbour.
template <class Kernel, class Done>
void insert_points(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                   std::uint32_t hint, Done done) {
  if constexpr (std::is_integral_v<typename Kernel::Coord>) {
    if (find_lattice(mesh, points, hint)) return insert_on_lattice(mesh, points, hint, done);
  }
  const Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points);
  const auto insert = [&](std::uint32_t i) {
    const Inserted inserted = insert_point(mesh, points[i], hint);
    hint = inserted.vertex;
    done(i, inserted);
  };
  for (std::uint32_t k = 0; k < order.size(); k += kSampleEvery) insert(order[k]);
  for (std::uint32_t k = 0; k < order.size(); ++k)
    if (k % kSampleEvery != 0) insert(order[k]);
}

}  // namespace terrace::tri::planar
