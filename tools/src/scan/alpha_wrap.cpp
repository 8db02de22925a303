// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include "scan/cgal_surface.hpp"

namespace terrace::tools {

tri::Surface alpha_wrap(std::span<const tri::Point3> points, double alpha, double offset) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_3> cgal_points;
  cgal_points.reserve(points.size());
  for (const tri::Point3& p : points) cgal_points.emplace_back(p[0], p[1], p[2]);
  CGAL::Surface_mesh<Kernel::Point_3> wrap;
  CGAL::alpha_wrap_3(cgal_points, alpha, offset, wrap);
  tri::Surface surface;
  std::vector<std::uint32_t> number(wrap.num_vertices() + wrap.number_of_removed_vertices());
  for (const auto v : wrap.vertices()) {
    number[v] = static_cast<std::uint32_t>(surface.points.size());
    const Kernel::Point_3& p = wrap.point(v);
    surface.points.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : wrap.faces()) {
    std::array<std::uint32_t, 3> face{};
    std::size_t i = 0;
    for (const auto v : wrap.vertices_around_face(wrap.halfedge(f))) face[i++] = number[v];
    surface.faces.push_back(face);
  }
  return surface;
}

}  // namespace terrace::tools
