// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// Turns the triangles around a vertex into a hole.
template <class Kernel>
void open_star(Mesh<Kernel>& mesh, std::uint32_t vertex) {
  auto& hole = mesh.hole;
  hole.vertex.clear();
  hole.point.clear();
  hole.outer.clear();
  hole.slots.clear();
  const std::uint32_t start = mesh.incident[vertex];
  std::uint32_t t = start;
  do {
    const Triangle& at = mesh.triangle[t];
    const std::uint32_t i = mesh.corner_index(t, vertex);
    const std::uint32_t next = next_index(i);
    hole.vertex.push_back(at.corner[next]);
    hole.point.push_back(mesh.point[at.corner[next]]);
    hole.outer.push_back(at.mate[i]);
    hole.slots.push_back(t);
    mesh.record(t);
    t = triangle_of(at.mate[next]);
  } while (t != start);
}

}  // namespace

template <class Kernel>
bool collinear(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices) {
  std::uint32_t a = kNone;
  std::uint32_t b = kNone;
  for (const std::uint32_t v : vertices) {
    if (v == kGhost) continue;
    if (a == kNone) {
      a = v;
    } else if (b == kNone) {
      b = v;
    } else if (Kernel::orientation(mesh.point[a], mesh.point[b], mesh.point[v]) != 0) {
      return false;
    }
  }
  return true;
}

template <class Point>
void turn_ghost_inside(Hole<Point>& hole) {
  if (hole.vertex.front() != kGhost && hole.vertex.back() != kGhost) return;
  const auto rotate = [offset = hole.vertex.front() == kGhost ? -1 : -2](auto& array) {
    std::rotate(array.begin(), array.end() + offset, array.end());
  };
  rotate(hole.vertex);
  rotate(hole.point);
  rotate(hole.outer);
}

template <class Kernel>
void remove_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex) {
  if (mesh.flat) {
    mesh.ticks(mesh.line.size());
    remove_flat(mesh, vertex);
    return;
  }
  open_star(mesh, vertex);
  auto& hole = mesh.hole;
  // If removing a vertex leaves a line, the vertex was joined to all of it.
  if (hole.vertex.size() + 1 >= mesh.vertex_count) [[unlikely]] {
    std::vector<std::uint32_t> survivors;
    for (const std::uint32_t v : hole.vertex)
      if (v != kGhost) survivors.push_back(v);
    if (survivors.size() + 1 == mesh.vertex_count && collinear<Kernel>(mesh, survivors)) {
      mesh.free_vertex_slot(vertex);
      become_flat(mesh, std::move(survivors));
      return;
    }
  }
  turn_ghost_inside(hole);
  fill_hole(mesh);
  for (const std::uint32_t t : hole.slots) mesh.free_triangle_slot(t);
  mesh.free_vertex_slot(vertex);
  mesh.last_vertex = hole.vertex.front();
}

#ifdef TERRACE_TRI_CORE
template void remove_vertex(Mesh<IntKernel>&, std::uint32_t);
template bool collinear(const Mesh<IntKernel>&, std::span<const std::uint32_t>);
template void turn_ghost_inside(Hole<IntKernel::Point>&);
template void remove_vertex(Mesh<WindowedKernel>&, std::uint32_t);
template bool collinear(const Mesh<WindowedKernel>&, std::span<const std::uint32_t>);
#else
template void remove_vertex(Mesh<DoubleKernel>&, std::uint32_t);
template void remove_vertex(Mesh<EllipticalKernel>&, std::uint32_t);
template bool collinear(const Mesh<DoubleKernel>&, std::span<const std::uint32_t>);
template bool collinear(const Mesh<EllipticalKernel>&, std::span<const std::uint32_t>);
template void turn_ghost_inside(Hole<DoubleKernel::Point>&);
#endif

}  // namespace terrace::tri::planar
