// SPDX-License-Identifier: Apache-2.0
#include "insert.hpp"

#include "cavity_insert.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "int_kernel.hpp"

namespace terrace::tri::spatial {

template <class Kernel>
void insert_vertex(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t conflict) {
  WholeMesh mesh_as_part;
  CavityInsertion<Kernel, WholeMesh>(mesh, mesh.cavity, mesh_as_part).run(vertex, conflict);
}

template <class Kernel>
Inserted insert_point(Mesh<Kernel>& mesh, const typename Kernel::Point& p, std::uint32_t hint) {
  mesh.ticks(kTicksOfInsertion);
  if (mesh.flat) return insert_flat(mesh, p);
  const std::uint32_t from = hint == kNone ? mesh.last_vertex : hint;
  const WalkEnd end = walk(mesh, p, mesh.vertex[from].incident);
  if (!end.outside) {
    const std::uint32_t equal = equal_corner(mesh, end.tetrahedron, p);
    if (equal != kNone) {
      mesh.last_vertex = equal;
      return {equal, false};
    }
  }
  const std::uint32_t vertex = mesh.new_vertex(p);
  insert_vertex(mesh, vertex, end.tetrahedron);
  mesh.last_vertex = vertex;
  return {vertex, true};
}

#ifdef TERRACE_TRI_CORE
template void insert_vertex(Mesh<IntKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<IntKernel>&, const IntKernel::Point&, std::uint32_t);
#else
template void insert_vertex(Mesh<DoubleKernel>&, std::uint32_t, std::uint32_t);
template void insert_vertex(Mesh<EllipticalKernel>&, std::uint32_t, std::uint32_t);
template Inserted insert_point(Mesh<DoubleKernel>&, const DoubleKernel::Point&, std::uint32_t);
template Inserted insert_point(Mesh<EllipticalKernel>&, const EllipticalKernel::Point&,
                               std::uint32_t);
#endif

}  // namespace terrace::tri::spatial
