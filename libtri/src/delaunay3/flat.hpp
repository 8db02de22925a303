// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "insert.hpp"
#include "mesh.hpp"

/// The states without tetrahedra: no point, or any number on a line or plane. The vertices then
/// wait in a sorted list, and the first point off their plane causes all of them to be inserted.

namespace terrace::tri::spatial {

/// insert_point() while flat.
template <class Kernel>
Inserted insert_flat(Mesh<Kernel>& mesh, const typename Kernel::Point& p);

/// Removes a set of vertices while flat.
template <class Kernel>
void remove_flat(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Drops all tetrahedra and rebuilds those of the survivors, which are all remaining vertices, from
/// scratch. The mesh becomes flat if they are coplanar.
template <class Kernel>
void restart(Mesh<Kernel>& mesh, std::vector<std::uint32_t> survivors);

/// True if the vertices are coplanar. A ghost among them is skipped.
template <class Kernel>
bool coplanar(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Adds p's vertex to the basis, the at most three vertices that span a point, line or plane, if it
/// is not in that span. Returns false, and adds nothing, if the basis spans a plane and p is off
/// it: the four of them then span space.
template <class Kernel>
bool extend_basis(const Mesh<Kernel>& mesh, std::vector<std::uint32_t>& basis,
                  std::uint32_t vertex) {
  const auto at = [&](std::size_t i) -> const auto& { return mesh.vertex[basis[i]].point; };
  const auto& p = mesh.vertex[vertex].point;
  switch (basis.size()) {
    case 0:
      basis.push_back(vertex);
      return true;
    case 1:
      if (!same_point(at(0), p)) basis.push_back(vertex);
      return true;
    case 2:
      if (!Kernel::collinear(at(0), at(1), p)) basis.push_back(vertex);
      return true;
    default:
      return Kernel::orientation(at(0), at(1), at(2), p) == 0;
  }
}

/// Makes the first tetrahedron and its ghosts from the three vertices of the basis and one off
/// their plane. Afterwards the basis is empty and the mesh is no longer flat.
template <class Kernel>
void make_first(Mesh<Kernel>& mesh, std::uint32_t apex);

}  // namespace terrace::tri::spatial
