// SPDX-License-Identifier: Apache-2.0
#include "double_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "int_kernel.hpp"

namespace terrace::tri::planar {
namespace {

using Epick = CGAL::Exact_predicates_inexact_constructions_kernel;

Epick::Point_2 cgal(const DoubleKernel::Point& p) { return {p[0], p[1]}; }

// Converts to integers that IntKernel accepts, counted from the least of them. Ties, which are
// frequent on rasters and scans, are cheap with integers. The predicates depend only on
// differences.
template <std::size_t N>
bool to_integers(const std::array<const DoubleKernel::Point*, N>& points,
                 std::array<IntKernel::Point, N>& result) {
  constexpr double kMaxExact = 0x1p52;  ///< below this, differences of integers are exact
  for (std::size_t k = 0; k < 2; ++k) {
    double least = kMaxExact;
    for (const DoubleKernel::Point* p : points) {
      const double at = (*p)[k];
      if (!(std::abs(at) < kMaxExact) || static_cast<double>(static_cast<std::int64_t>(at)) != at)
        return false;
      least = std::min(least, at);
    }
    for (std::size_t i = 0; i < N; ++i) {
      const double difference = (*points[i])[k] - least;
      if (!(difference < IntKernel::kLimit)) return false;
      result[i][k] = static_cast<IntKernel::Coord>(difference);
    }
  }
  return true;
}

}  // namespace

int DoubleKernel::orientation_exact(const Point& a, const Point& b, const Point& c) {
  std::array<IntKernel::Point, 3> integers;
  if (to_integers<3>({&a, &b, &c}, integers))
    return IntKernel::orientation(integers[0], integers[1], integers[2]);
  return Epick().orientation_2_object()(cgal(a), cgal(b), cgal(c));
}

int DoubleKernel::in_circle_exact(const Point& a, const Point& b, const Point& c, const Point& p) {
  std::array<IntKernel::Point, 4> integers;
  if (to_integers<4>({&a, &b, &c, &p}, integers))
    return IntKernel::in_circle(integers[0], integers[1], integers[2], integers[3]);
  return Epick().side_of_oriented_circle_2_object()(cgal(a), cgal(b), cgal(c), cgal(p));
}

int DoubleKernel::compare_distance(const Point& p, const Point& a, const Point& b) {
  return Epick().compare_distance_2_object()(cgal(p), cgal(a), cgal(b));
}

}  // namespace terrace::tri::planar
