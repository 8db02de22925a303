// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <gtest/gtest.h>

#include "delaunay3/access.hpp"

/// Uses CGAL's Delaunay_triangulation_3 as an oracle, including ties: it perturbs in the same
/// order, so the sets of tetrahedra must be equal for any input.

namespace terrace::tri {

using Kernel3 = CGAL::Exact_predicates_inexact_constructions_kernel;
using Oracle3 = CGAL::Delaunay_triangulation_3<Kernel3>;
using Corners3 = std::array<std::array<double, 3>, 4>;

inline std::vector<Corners3> tetrahedra_of(const Oracle3& oracle) {
  std::vector<Corners3> result;
  if (oracle.dimension() < 3) return result;
  for (const auto& cell : oracle.finite_cell_handles()) {
    Corners3 corners;
    for (int i = 0; i < 4; ++i) {
      const auto& p = cell->vertex(i)->point();
      corners[static_cast<std::size_t>(i)] = {p.x(), p.y(), p.z()};
    }
    std::sort(corners.begin(), corners.end());
    result.push_back(corners);
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Coord>
std::vector<Corners3> tetrahedra_of(const Delaunay3<Coord>& triangulation) {
  std::vector<Corners3> result;
  for (const TetrahedronId id : triangulation.all_tetrahedra()) {
    Corners3 corners;
    const auto vertices = triangulation.vertices(id);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = triangulation.point(vertices[i]);
      corners[i] = {static_cast<double>(p[0]), static_cast<double>(p[1]),
                    static_cast<double>(p[2])};
    }
    std::sort(corners.begin(), corners.end());
    result.push_back(corners);
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Coord>
std::vector<Kernel3::Point_3> to_cgal(const std::vector<std::array<Coord, 3>>& points) {
  std::vector<Kernel3::Point_3> result;
  for (const auto& p : points)
    result.emplace_back(static_cast<double>(p[0]), static_cast<double>(p[1]),
                        static_cast<double>(p[2]));
  return result;
}

template <class Coord>
void expect_equal_to_cgal(const Delaunay3<Coord>& triangulation, const Oracle3& oracle) {
  EXPECT_EQ(find_fault(triangulation), "");
  EXPECT_EQ(triangulation.vertex_count(), oracle.number_of_vertices());
  const auto ours = tetrahedra_of(triangulation);
  EXPECT_EQ(ours.size(), triangulation.tetrahedron_count());
  EXPECT_TRUE(ours == tetrahedra_of(oracle));
}

}  // namespace terrace::tri
