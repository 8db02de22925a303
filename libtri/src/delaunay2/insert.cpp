// SPDX-License-Identifier: GPL-3.0-or-later
#include "insert.hpp"

#include "double_kernel.hpp"
#include "flat.hpp"
#include "int_kernel.hpp"
#include "predicates.hpp"
#include "walk.hpp"

namespace terrace::tri::planar {

template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict) {
  const typename Kernel::Point p = mesh.point[vertex];
  std::vector<Side>& pending = mesh.sides;
  // Slots of cavity triangles to be used again at once. A cavity of k triangles has k + 2 edges.
  std::vector<std::uint32_t>& spare = mesh.spare;
  pending.clear();
  spare.clear();
  spare.push_back(mesh.new_triangle());
  spare.push_back(mesh.new_triangle());

  const auto remove = [&](std::uint32_t t) {
    mesh.record(t);
    spare.push_back(t);
  };
  {
    const Triangle& t = mesh.triangle[conflict];
    pending.push_back(t.mate[1]);
    pending.push_back(t.mate[0]);
    pending.push_back(t.mate[2]);
    remove(conflict);
  }

  std::uint32_t first = kNone;
  std::uint32_t previous = kNone;
  while (!pending.empty()) {
    const Side side = pending.back();
    pending.pop_back();
    const std::uint32_t outer = triangle_of(side);
    const std::uint32_t i = index_of(side);
    Triangle& t = mesh.triangle[outer];
    if (in_conflict(mesh, t, p)) {
      pending.push_back(t.mate[previous_index(i)]);
      pending.push_back(t.mate[next_index(i)]);
      remove(outer);
      continue;
    }
    // The edge seen from inside the cavity.
    const std::uint32_t from = t.corner[previous_index(i)];
    const std::uint32_t to = t.corner[next_index(i)];
    const std::uint32_t created = spare.back();
    spare.pop_back();
    t.mate[i] = make_side(created, 0);
    mesh.triangle[created] = {{vertex, from, to}, {side, 0, make_side(previous, 1)}};
    mesh.incident[from] = created;
    if (previous == kNone) {
      first = created;
    } else {
      mesh.triangle[previous].mate[1] = make_side(created, 2);
    }
    previous = created;
  }
  mesh.link(make_side(previous, 1), make_side(first, 2));
  mesh.incident[vertex] = previous;
}

template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint) {
  if (mesh.flat) return insert_flat(mesh, p);
  const std::uint32_t from = hint == kNone ? mesh.last_vertex : hint;
  const WalkEnd end = walk(mesh, p, mesh.incident[from]);
  if (!end.outside) {
    const std::uint32_t equal = equal_corner(mesh, end.triangle, p);
    if (equal != kNone) {
      mesh.last_vertex = equal;
      return {equal, false};
    }
  }
  const std::uint32_t vertex = mesh.new_vertex(p);
  insert_vertex(mesh, vertex, end.triangle);
  mesh.last_vertex = vertex;
  return {vertex, true};
}

template void insert_vertex(Mesh<IntKernel>&, std::uint32_t, std::uint32_t);
template void insert_vertex(Mesh<DoubleKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<IntKernel>&, const IntKernel::Point&, std::uint32_t);
template Inserted insert_point(Mesh<DoubleKernel>&, const DoubleKernel::Point&, std::uint32_t);

}  // namespace terrace::tri::planar
