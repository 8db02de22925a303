// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "insert.hpp"
#include "mesh.hpp"

/// The states without triangles: no point, one, or any number on a line. The vertices are then kept
/// as a sorted sequence, and the first point off the line turns it into a fan.

namespace terrace::tri::planar {

/// insert_point() while flat.
template <class Kernel>
Inserted insert_flat(Mesh<Kernel>& mesh, const typename Kernel::Point& p);

/// True if p is on the line of the sorted points, and while they do not span a line.
template <class Kernel>
bool on_line(const Mesh<Kernel>& mesh, const typename Kernel::Point& p) {
  const auto& line = mesh.line;
  return line.size() < 2 ||
         Kernel::orientation(mesh.point[line.front()], mesh.point[line.back()], p) == 0;
}

/// Joins all vertices of the line to a vertex off it, which is the only triangulation of such
/// points.
template <class Kernel>
void make_fan(Mesh<Kernel>& mesh, std::uint32_t apex);

/// Drops all triangles. `survivors`: all remaining vertices, which are collinear, in any order.
template <class Kernel>
void become_flat(Mesh<Kernel>& mesh, std::vector<std::uint32_t> survivors);

/// Removes a vertex while flat.
template <class Kernel>
void remove_flat(Mesh<Kernel>& mesh, std::uint32_t vertex);

}  // namespace terrace::tri::planar
