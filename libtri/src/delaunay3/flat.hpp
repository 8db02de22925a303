// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "insert.hpp"
#include "mesh.hpp"

/// The states without a tetrahedron: no point, or any number on a line or plane. Then the vertices
/// wait in a sorted list, and the first point beside their plane lets all of them in.

namespace terrace::tri::spatial {

/// insert_point() while flat.
template <class Kernel>
Inserted insert_flat(Mesh<Kernel>& mesh, const typename Kernel::Point& p);

/// Removes a set of vertices while flat.
template <class Kernel>
void remove_flat(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Drops all tetrahedra and makes those of the survivors, which are all vertices left, from
/// nothing; flat if they are coplanar.
template <class Kernel>
void restart(Mesh<Kernel>& mesh, std::vector<std::uint32_t> survivors);

/// Whether vertices (the ghost among them is passed over) lie in one plane.
template <class Kernel>
bool coplanar(const Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Adds p's vertex to the at most three that span a point, line or plane, if it is not on it yet.
/// False, and nothing is added, where it is off their plane: the four of them span space.
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

/// The first tetrahedron and its ghosts, of the three vertices of the basis and one off their
/// plane. The basis is forgotten and the mesh is no longer flat.
template <class Kernel>
void make_first(Mesh<Kernel>& mesh, std::uint32_t apex);

}  // namespace terrace::tri::spatial
