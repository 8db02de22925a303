// SPDX-License-Identifier: Apache-2.0
#include "flat.hpp"

#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// The position of p in the sorted line, or where it would be.
template <class Kernel>
std::vector<std::uint32_t>::iterator find_on_line(Mesh<Kernel>& mesh,
                                                  const typename Kernel::Point& p) {
  return std::lower_bound(mesh.line.begin(), mesh.line.end(), p,
                          [&](std::uint32_t v, const auto& value) {
                            return lexicographically_less(mesh.point[v], value);
                          });
}

}  // namespace

template <class Kernel>
Inserted insert_flat(Mesh<Kernel>& mesh, const typename Kernel::Point& p) {
  const auto at = find_on_line(mesh, p);
  if (at != mesh.line.end() && mesh.point[*at] == p) return {*at, false};
  const std::uint32_t vertex = mesh.new_vertex(p);
  if (on_line(mesh, p)) {
    mesh.line.insert(at, vertex);
  } else {
    make_fan(mesh, vertex);
  }
  mesh.last_vertex = vertex;
  return {vertex, true};
}

template <class Kernel>
void make_fan(Mesh<Kernel>& mesh, std::uint32_t apex) {
  std::vector<std::uint32_t> line = std::move(mesh.line);
  mesh.line = {};
  mesh.flat = false;
  // Orients the line so that apex, line[i], line[i + 1] turn left.
  if (Kernel::orientation(mesh.point[line.front()], mesh.point[line.back()], mesh.point[apex]) < 0)
    std::reverse(line.begin(), line.end());

  // The fan has `edges` finite triangles (apex, line[i], line[i + 1]), the ghosts (ghost, line[i +
  // 1], line[i]) beyond them, and two ghosts at its ends.
  const auto edges = static_cast<std::uint32_t>(line.size()) - 1;
  std::vector<std::uint32_t> slots(2 * edges + 2);
  for (std::uint32_t& t : slots) t = mesh.new_triangle();
  const auto finite_triangle = [&](std::uint32_t i) { return slots[i]; };
  const auto ghost_triangle = [&](std::uint32_t i) { return slots[edges + i]; };
  const std::uint32_t first_end = slots[2 * edges];
  const std::uint32_t last_end = slots[2 * edges + 1];
  for (std::uint32_t i = 0; i < edges; ++i) {
    mesh.triangle[finite_triangle(i)].corner = {apex, line[i], line[i + 1]};
    mesh.triangle[ghost_triangle(i)].corner = {kGhost, line[i + 1], line[i]};
    mesh.incident[line[i]] = finite_triangle(i);
  }
  mesh.incident[line[edges]] = finite_triangle(edges - 1);
  mesh.incident[apex] = finite_triangle(0);
  mesh.incident[kGhost] = first_end;
  mesh.triangle[first_end].corner = {kGhost, line[0], apex};
  mesh.triangle[last_end].corner = {kGhost, apex, line[edges]};

  for (std::uint32_t i = 0; i < edges; ++i) {
    mesh.link(make_side(finite_triangle(i), 0), make_side(ghost_triangle(i), 0));
    if (i == 0) continue;
    mesh.link(make_side(finite_triangle(i), 2), make_side(finite_triangle(i - 1), 1));
    mesh.link(make_side(ghost_triangle(i), 1), make_side(ghost_triangle(i - 1), 2));
  }
  mesh.link(make_side(first_end, 0), make_side(finite_triangle(0), 2));
  mesh.link(make_side(last_end, 0), make_side(finite_triangle(edges - 1), 1));
  mesh.link(make_side(first_end, 1), make_side(last_end, 2));
  mesh.link(make_side(first_end, 2), make_side(ghost_triangle(0), 1));
  mesh.link(make_side(last_end, 1), make_side(ghost_triangle(edges - 1), 2));
}

template <class Kernel>
void become_flat(Mesh<Kernel>& mesh, std::vector<std::uint32_t> survivors) {
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.triangle[t].corner[0] == kFreeCorner) continue;
    mesh.record(t);
    mesh.free_triangle_slot(t);
  }
  for (const std::uint32_t v : survivors) mesh.incident[v] = kNoIncident;
  mesh.incident[kGhost] = kNoIncident;
  std::sort(survivors.begin(), survivors.end(), [&](std::uint32_t a, std::uint32_t b) {
    return lexicographically_less(mesh.point[a], mesh.point[b]);
  });
  mesh.last_vertex = survivors.empty() ? kNone : survivors.front();
  mesh.line = std::move(survivors);
  mesh.flat = true;
}

template <class Kernel>
void remove_flat(Mesh<Kernel>& mesh, std::uint32_t vertex) {
  mesh.line.erase(find_on_line(mesh, mesh.point[vertex]));
  mesh.free_vertex_slot(vertex);
  mesh.last_vertex = mesh.line.empty() ? kNone : mesh.line.front();
}

#ifdef TERRACE_TRI_CORE
template Inserted insert_flat(Mesh<IntKernel>&, const IntKernel::Point&);
template void make_fan(Mesh<IntKernel>&, std::uint32_t);
template void become_flat(Mesh<IntKernel>&, std::vector<std::uint32_t>);
template void remove_flat(Mesh<IntKernel>&, std::uint32_t);
template Inserted insert_flat(Mesh<WindowedKernel>&, const WindowedKernel::Point&);
template void make_fan(Mesh<WindowedKernel>&, std::uint32_t);
template void become_flat(Mesh<WindowedKernel>&, std::vector<std::uint32_t>);
template void remove_flat(Mesh<WindowedKernel>&, std::uint32_t);
#else
template Inserted insert_flat(Mesh<DoubleKernel>&, const DoubleKernel::Point&);
template Inserted insert_flat(Mesh<EllipticalKernel>&, const EllipticalKernel::Point&);
template void make_fan(Mesh<DoubleKernel>&, std::uint32_t);
template void make_fan(Mesh<EllipticalKernel>&, std::uint32_t);
template void become_flat(Mesh<DoubleKernel>&, std::vector<std::uint32_t>);
template void become_flat(Mesh<EllipticalKernel>&, std::vector<std::uint32_t>);
template void remove_flat(Mesh<DoubleKernel>&, std::uint32_t);
template void remove_flat(Mesh<EllipticalKernel>&, std::uint32_t);
#endif

}  // namespace terrace::tri::planar
