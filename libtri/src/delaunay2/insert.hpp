// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "hilbert.hpp"
#include "mesh.hpp"

namespace terrace::tri::planar {

/// Joins a vertex, which has its slot and point but no triangle, to a triangulation with triangles.
/// `conflict`: a triangle in conflict with it, as found by walk() if no corner equals the point.
///
/// Bowyer and Watson's cavity, traversed depth-first across edges. It contains no vertex, so the
/// traversal is a tree and needs no marks, and it meets the cavity's boundary in counter-clockwise
/// order, so each new triangle is linked to the previous one. About 4.2 triangles are replaced.
template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict);

/// Inserts a point, or finds the vertex that equals it. `hint`: a living vertex, or kNone.
struct Inserted {
  std::uint32_t vertex;
  bool created;
};
template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);

/// Inserts points in an order of its own. Calls done(number, inserted) for each.
///
/// The hint of a point is the previous one on a Hilbert curve. As in bulk construction a coarse
/// sample goes first: it saves a quarter of the temporary triangles.
template <class Kernel, class Done>
void insert_points(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                   std::uint32_t hint, Done done) {
  constexpr std::uint32_t kSample = 8;
  const Pool<std::uint32_t> order = hilbert_order<typename Kernel::Coord>(points);
  const auto insert = [&](std::uint32_t i) {
    const Inserted inserted = insert_point(mesh, points[i], hint);
    hint = inserted.vertex;
    done(i, inserted);
  };
  for (std::uint32_t k = 0; k < order.size(); k += kSample) insert(order[k]);
  for (std::uint32_t k = 0; k < order.size(); ++k)
    if (k % kSample != 0) insert(order[k]);
}

}  // namespace terrace::tri::planar
