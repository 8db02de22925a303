// SPDX-License-Identifier: Apache-2.0
#include "flat.hpp"

#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "walk.hpp"

namespace terrace::tri::spatial {
namespace {

/// Orders vertices by their points.
template <class Kernel>
auto by_point(const Mesh<Kernel>& mesh) {
  return [&mesh](std::uint32_t a, std::uint32_t b) {
    return lexicographically_less(mesh.vertex[a].point, mesh.vertex[b].point);
  };
}

/// Finds the basis of the waiting vertices. Returns the first one off their plane, or kNone.
template <class Kernel>
std::uint32_t find_basis(Mesh<Kernel>& mesh) {
  mesh.basis.clear();
  for (const std::uint32_t v : mesh.flat_vertices)
    if (!extend_basis(mesh, mesh.basis, v)) return v;
  return kNone;
}

/// Inserts all waiting vertices. `apex`, one of them, is off the plane of the basis.
template <class Kernel>
void leave_flat(Mesh<Kernel>& mesh, std::uint32_t apex) {
  const std::vector<std::uint32_t> flat_vertices = std::move(mesh.flat_vertices);
  mesh.flat_vertices = {};
  const std::vector<std::uint32_t> basis = mesh.basis;
  make_first(mesh, apex);
  std::vector<typename Kernel::Point> points;
  points.reserve(flat_vertices.size());
  for (const std::uint32_t v : flat_vertices) points.push_back(mesh.vertex[v].point);
  const Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points);
  std::uint32_t hint = apex;
  visit_coarse_first(order.size(), [&](std::uint32_t k) {
    const std::uint32_t v = flat_vertices[order[k]];
    if (v == apex || std::find(basis.begin(), basis.end(), v) != basis.end()) return;
    insert_vertex(mesh, v,
                  walk(mesh, mesh.vertex[v].point, mesh.vertex[hint].incident).tetrahedron);
    hint = v;
  });
}

}  // namespace

template <class Kernel>
Inserted insert_flat(Mesh<Kernel>& mesh, const typename Kernel::Point& p) {
  const auto at = std::lower_bound(mesh.flat_vertices.begin(), mesh.flat_vertices.end(), p,
                                   [&](std::uint32_t v, const auto& value) {
                                     return lexicographically_less(mesh.vertex[v].point, value);
                                   });
  if (at != mesh.flat_vertices.end() && same_point(mesh.vertex[*at].point, p)) return {*at, false};
  const std::uint32_t vertex = mesh.new_vertex(p);
  mesh.flat_vertices.insert(at, vertex);
  if (!extend_basis(mesh, mesh.basis, vertex)) leave_flat(mesh, vertex);
  mesh.last_vertex = vertex;
  return {vertex, true};
}

template <class Kernel>
void remove_flat(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices) {
  if (vertices.size() == 1) {
    mesh.flat_vertices.erase(std::lower_bound(mesh.flat_vertices.begin(), mesh.flat_vertices.end(),
                                              vertices[0], by_point(mesh)));
    mesh.free_vertex_slot(vertices[0]);
  } else {
    for (const std::uint32_t v : vertices) mesh.free_vertex_slot(v);
    std::erase_if(mesh.flat_vertices, [&](std::uint32_t v) { return !mesh.vertex_alive(v); });
  }
  for (const std::uint32_t v : mesh.basis) {
    if (mesh.vertex_alive(v)) continue;
    find_basis(mesh);
    break;
  }
  mesh.last_vertex = mesh.flat_vertices.empty() ? kNone : mesh.flat_vertices.front();
}

template <class Kernel>
void restart(Mesh<Kernel>& mesh, std::vector<std::uint32_t> survivors) {
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
    if (mesh.tetrahedron[t].corner[0] == kFreeCorner) continue;
    mesh.record(t);
    mesh.mark[t] = kUnknown;
    mesh.free_tetrahedron_slot(t);
  }
  mesh.finite_count = 0;
  mesh.flat = true;
  for (const std::uint32_t v : survivors) mesh.vertex[v].incident = kNoIncident;
  std::sort(survivors.begin(), survivors.end(), by_point(mesh));
  mesh.last_vertex = survivors.empty() ? kNone : survivors.front();
  mesh.flat_vertices = std::move(survivors);
  const std::uint32_t apex = find_basis(mesh);
  if (apex != kNone) leave_flat(mesh, apex);
}

template <class Kernel>
bool coplanar(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices) {
  std::vector<std::uint32_t> basis;
  return std::all_of(vertices.begin(), vertices.end(),
                     [&](std::uint32_t v) { return v == kGhost || extend_basis(mesh, basis, v); });
}

template <class Kernel>
void make_first(Mesh<Kernel>& mesh, std::uint32_t apex) {
  std::array<std::uint32_t, 4> corner = {mesh.basis[0], mesh.basis[1], mesh.basis[2], apex};
  const auto at = [&](std::size_t i) -> const auto& { return mesh.vertex[corner[i]].point; };
  if (Kernel::orientation(at(0), at(1), at(2), at(3)) < 0) std::swap(corner[0], corner[1]);
  const std::uint32_t first = mesh.new_tetrahedron();
  mesh.tetrahedron[first].corner = corner;
  std::array<std::uint32_t, 4> ghost;
  for (std::size_t i = 0; i < 4; ++i) {
    ghost[i] = mesh.new_tetrahedron();
    auto& c = mesh.tetrahedron[ghost[i]].corner;
    c = corner;
    c[i] = kGhost;
    std::swap(c[(i + 1) % 4], c[(i + 2) % 4]);
    mesh.vertex[corner[i]].incident = first;
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    mesh.link(make_side(first, i), make_side(ghost[i], i));
    for (std::uint32_t k = 0; k < i; ++k)
      mesh.link(make_side(ghost[i], mesh.corner_index(ghost[i], corner[k])),
                make_side(ghost[k], mesh.corner_index(ghost[k], corner[i])));
  }
  mesh.basis.clear();
  mesh.flat = false;
  mesh.finite_count = 1;
}

#define TERRACE_INSTANTIATE(Kernel)                                            \
  template Inserted insert_flat(Mesh<Kernel>&, const Kernel::Point&);          \
  template void remove_flat(Mesh<Kernel>&, std::span<const std::uint32_t>);    \
  template void restart(Mesh<Kernel>&, std::vector<std::uint32_t>);            \
  template bool coplanar(const Mesh<Kernel>&, std::span<const std::uint32_t>); \
  template void make_first(Mesh<Kernel>&, std::uint32_t);
#ifdef TERRACE_TRI_CORE
TERRACE_INSTANTIATE(IntKernel)
#else
TERRACE_INSTANTIATE(DoubleKernel)
TERRACE_INSTANTIATE(EllipticalKernel)
#endif
#undef TERRACE_INSTANTIATE

}  // namespace terrace::tri::spatial
