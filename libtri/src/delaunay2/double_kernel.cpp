// SPDX-License-Identifier: Apache-2.0
#include "double_kernel.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "int_kernel.hpp"

namespace terrace::tri::planar {
namespace {

using Epick = CGAL::Exact_predicates_inexact_constructions_kernel;

Epick::Point_2 cgal(const DoubleKernel::Point& p) { return {p[0], p[1]}; }

// Converts to integers that IntKernel can take: with them ties, which are frequent on rasters, are
// cheap.
bool to_integers(const DoubleKernel::Point& p, IntKernel::Point& result) {
  for (std::size_t k = 0; k < 2; ++k) {
    if (!(p[k] >= 0 && p[k] < IntKernel::kLimit)) return false;
    result[k] = static_cast<IntKernel::Coord>(p[k]);
    if (result[k] != p[k]) return false;
  }
  return true;
}

template <std::size_t N>
bool to_integers(const std::array<const DoubleKernel::Point*, N>& points,
                 std::array<IntKernel::Point, N>& result) {
  for (std::size_t i = 0; i < N; ++i)
    if (!to_integers(*points[i], result[i])) return false;
  return true;
}

}  // namespace

int DoubleKernel::orientation_exact(const Point& a, const Point& b, const Point& c) {
  std::array<IntKernel::Point, 3> whole;
  if (to_integers<3>({&a, &b, &c}, whole))
    return IntKernel::orientation(whole[0], whole[1], whole[2]);
  return Epick().orientation_2_object()(cgal(a), cgal(b), cgal(c));
}

int DoubleKernel::in_circle_exact(const Point& a, const Point& b, const Point& c, const Point& p) {
  std::array<IntKernel::Point, 4> whole;
  if (to_integers<4>({&a, &b, &c, &p}, whole))
    return IntKernel::in_circle(whole[0], whole[1], whole[2], whole[3]);
  return Epick().side_of_oriented_circle_2_object()(cgal(a), cgal(b), cgal(c), cgal(p));
}

int DoubleKernel::compare_distance(const Point& p, const Point& a, const Point& b) {
  return Epick().compare_distance_2_object()(cgal(p), cgal(a), cgal(b));
}

}  // namespace terrace::tri::planar
