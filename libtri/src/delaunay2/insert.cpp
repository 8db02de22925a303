// SPDX-License-Identifier: Apache-2.0
#include "insert.hpp"

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "int_kernel.hpp"
#include "predicates.hpp"
#include "walk.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {

template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict) {
  const typename Kernel::Point p = mesh.point[vertex];
  // Sides still to be crossed, and slots of cavity triangles, which are reused at once. A cavity of
  // k triangles has k + 2 edges, so neither list ever holds more than k + 2.
  const std::uint32_t spare_first = mesh.new_triangle();
  const std::uint32_t spare_second = mesh.new_triangle();
  constexpr std::size_t kSpares = 2;
  if (mesh.sides.empty()) mesh.sides.resize(64);
  if (mesh.spare.size() < mesh.sides.size()) mesh.spare.resize(mesh.sides.size());
  Side* pending = mesh.sides.data();
  std::uint32_t* spare = mesh.spare.data();
  std::size_t pending_count = 0;
  std::size_t spare_count = kSpares;
  spare[0] = spare_first;
  spare[1] = spare_second;
  std::size_t max_removed = mesh.sides.size() - kSpares;
  // The pools do not grow from here on.
  Triangle* const triangle = mesh.triangle.data();
  const auto* const point = mesh.point.data();
  std::uint32_t* const incident = mesh.incident.data();
  const bool recording = mesh.journal.on();

  std::size_t removed = 0;
  const auto remove = [&](std::uint32_t t) {
    if (recording) [[unlikely]]
      mesh.record(t);
    if (++removed > max_removed) [[unlikely]] {
      mesh.sides.resize(2 * mesh.sides.size());
      mesh.spare.resize(mesh.sides.size());
      pending = mesh.sides.data();
      spare = mesh.spare.data();
      max_removed = mesh.sides.size() - kSpares;
    }
    spare[spare_count++] = t;
  };

  remove(conflict);
  pending[pending_count++] = triangle[conflict].mate[1];
  pending[pending_count++] = triangle[conflict].mate[0];
  Side side = triangle[conflict].mate[2];
  std::uint32_t first = kNone;
  std::uint32_t previous = kNone;
  while (true) {
    const std::uint32_t outer = triangle_of(side);
    const std::uint32_t i = index_of(side);
    Triangle& t = triangle[outer];
    if (in_conflict<Kernel>(point, t, p)) {
      remove(outer);
      side = t.mate[next_index(i)];
      pending[pending_count++] = t.mate[previous_index(i)];
      __builtin_prefetch(&triangle[triangle_of(t.mate[previous_index(i)])]);
      continue;
    }
    // The edge seen from inside the cavity.
    const std::uint32_t from = t.corner[previous_index(i)];
    const std::uint32_t to = t.corner[next_index(i)];
    const std::uint32_t created = spare[--spare_count];
    t.mate[i] = make_side(created, 0);
    triangle[created] = {{vertex, from, to}, {side, 0, make_side(previous, 1)}};
    incident[from] = created;
    if (previous == kNone) {
      first = created;
    } else {
      triangle[previous].mate[1] = make_side(created, 2);
    }
    previous = created;
    if (pending_count == 0) break;
    side = pending[--pending_count];
  }
  mesh.link(make_side(previous, 1), make_side(first, 2));
  incident[vertex] = previous;
  mesh.prefetch_free_triangle();
  constexpr std::size_t kTicksOfTriangle = 32;
  mesh.ticks(kTicksOfTriangle * removed);
}

template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint) {
  mesh.ticks(kTicksOfWalk);
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

#ifdef TERRACE_TRI_CORE
template void insert_vertex(Mesh<IntKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<IntKernel>&, const IntKernel::Point&, std::uint32_t);
template void insert_vertex(Mesh<WindowedKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<WindowedKernel>&, const WindowedKernel::Point&, std::uint32_t);
#else
template void insert_vertex(Mesh<DoubleKernel>&, std::uint32_t, std::uint32_t);
template void insert_vertex(Mesh<EllipticalKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<DoubleKernel>&, const DoubleKernel::Point&, std::uint32_t);
template Inserted insert_point(Mesh<EllipticalKernel>&, const EllipticalKernel::Point&,
                               std::uint32_t);
#endif

}  // namespace terrace::tri::planar
