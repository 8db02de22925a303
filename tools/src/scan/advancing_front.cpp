// SPDX-License-Identifier: GPL-3.0-or-later
#include <iterator>

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <terrace/base/stop_check.hpp>

#include "scan/cgal_surface.hpp"

namespace terrace::tools {

namespace {

/// Calls the stop check, then returns CGAL's default priority of a facet.
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
  std::vector<Kernel::Point_3> cgal_points;
  cgal_points.reserve(points.size());
  for (const tri::Point3& p : points) cgal_points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<std::size_t, 3>> triples;
  CGAL::advancing_front_surface_reconstruction(cgal_points.begin(), cgal_points.end(),
                                               std::back_inserter(triples),
                                               CheckedPriority{&check_stop}, 5.0, 0.52);
  std::vector<std::array<std::uint32_t, 3>> faces;
  faces.reserve(triples.size());
  for (const auto& f : triples)
    faces.push_back({static_cast<std::uint32_t>(f[0]), static_cast<std::uint32_t>(f[1]),
                     static_cast<std::uint32_t>(f[2])});
  return faces;
}

}  // namespace terrace::tools
