// SPDX-License-Identifier: GPL-3.0-or-later
#include <iterator>

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <terrace/base/stop_check.hpp>

#include "scan/cgal_surface.hpp"

namespace terrace::tools {

namespace {

/// CGAL's default priority of a facet, after a stop check.
struct CheckedPriority {
  const base::StopCheck* check_stop;

  template <class Front, class Cell>
  double operator()(const Front& front, Cell& cell, const int& index) const {
    if (*check_stop) (*check_stop)();
    return front.smallest_radius_delaunay_sphere(cell, index);
  }
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> advancing_front(std::span<const tri::Point3> points,
                                                          const base::StopCheck& check_stop) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_3> of_cgal;
  of_cgal.reserve(points.size());
  for (const tri::Point3& p : points) of_cgal.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<std::size_t, 3>> found;
  CGAL::advancing_front_surface_reconstruction(of_cgal.begin(), of_cgal.end(),
                                               std::back_inserter(found),
                                               CheckedPriority{&check_stop}, 5.0, 0.52);
  std::vector<std::array<std::uint32_t, 3>> faces;
  faces.reserve(found.size());
  for (const auto& f : found)
    faces.push_back({static_cast<std::uint32_t>(f[0]), static_cast<std::uint32_t>(f[1]),
                     static_cast<std::uint32_t>(f[2])});
  return faces;
}

}  // namespace terrace::tools
