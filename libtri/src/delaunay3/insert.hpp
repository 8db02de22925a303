// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <terrace/base/stop_check.hpp>

#include "curve_sort.hpp"
#include "mesh.hpp"

namespace terrace::tri::spatial {

/// What one insertion costs, see base::StopTicks.
inline constexpr std::size_t kTicksOfInsertion = 2048;

/// Joins a vertex, which has its slot and point but no tetrahedron, to a triangulation with
/// tetrahedra. `conflict`: a tetrahedron in conflict with it, as found by walk() if no corner
/// equals the point. See cavity_insert.hpp.
template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict);

/// Inserts a point, or finds the vertex that equals it. `hint`: an existing vertex, or kNone.
struct Inserted {
  std::uint32_t vertex;
  bool created;
};
template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint);

/// Calls visit(k) for all k below count: every fourth of them, before that every fourth of these,
/// and so on from the coarsest. Points of a curve inserted in this order make half as many
/// temporary tetrahedra as in the order of the curve (after N. Amenta, S. Choi, G. Rote,
/// "Incremental constructions con BRIO", doi:10.1145/777792.777824, with fixed samples instead of
/// random ones).
template <class Visit>
void visit_coarse_first(std::uint32_t count, Visit visit) {
  constexpr std::uint32_t kFactor = 4;
  std::uint32_t step = 1;
  while (count / step > kFactor * kFactor) step *= kFactor;
  for (bool coarsest = true; step > 0; step /= kFactor, coarsest = false)
    for (std::uint32_t k = 0; k < count; k += step)
      if (coarsest || k % (step * kFactor) != 0) visit(k);
}

/// Inserts points along a Hilbert curve, coarse samples first. Calls done(number, inserted) for
/// each.
template <class Kernel, class Done>
void insert_points(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                   std::uint32_t hint, Done done) {
  const Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points);
  visit_coarse_first(order.size(), [&](std::uint32_t k) {
    const Inserted inserted = insert_point(mesh, points[order[k]], hint);
    hint = inserted.vertex;
    done(order[k], inserted);
  });
}

/// Set in Vertex::incident during bulk construction if the point is a duplicate. The other bits are
/// the vertex that represents it.
inline constexpr std::uint32_t kAlias = kFreeVertexBit;

/// Vertices begin, ..., end - 1 follow each other along a curve. Of these begin + step, begin + 2
/// step, ... exist or are inserted next.
struct Curve {
  std::uint32_t begin, end, step;
};

/// Inserts some vertices of a curve, with at most two concurrent threads. The result, slots
/// included, does not depend on the number of threads. Requires sorted vertices, which it reorders.
template <class Kernel>
void insert_in_parallel(Mesh<Kernel>& mesh, const Curve& curve, std::span<std::uint32_t> vertices,
                        unsigned threads);

/// Inserts one vertex, walking from the vertex `hint`.
template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t hint);

}  // namespace terrace::tri::spatial
