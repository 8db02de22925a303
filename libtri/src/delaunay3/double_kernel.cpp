// SPDX-License-Identifier: Apache-2.0
#include "double_kernel.hpp"

#include <bit>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "../delaunay2/double_kernel.hpp"
#include "int_kernel.hpp"

namespace terrace::tri::spatial {
namespace {

using Epick = CGAL::Exact_predicates_inexact_constructions_kernel;

Epick::Point_3 cgal(const DoubleKernel::Point& p) { return {p[0], p[1], p[2]}; }

// Converts to integers whose differences IntKernel accepts. Ties, which are frequent on grids, are
// cheap with integers.
bool to_integers(const DoubleKernel::Point& p, IntKernel::Point& result) {
  constexpr double kLimit = 0x1p29;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(p[k] > -kLimit && p[k] < kLimit)) return false;
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

void DoubleKernel::Lattice::add(double c) {
  const auto bits = std::bit_cast<std::uint64_t>(c);
  const std::uint64_t fraction = bits & ((std::uint64_t{1} << 52) - 1);
  const int biased = static_cast<int>(bits >> 52 & 0x7FF);
  if (biased == 0 && fraction == 0) return;
  const int lowest = biased - 1075 + std::countr_zero(fraction | std::uint64_t{1} << 52);
  if (lowest >= exponent_) return;
  exponent_ = lowest;
  // All powers of the differences are then far from underflow and overflow.
  exact_fifth_ = exponent_ < kMinExponent ? 0 : std::ldexp(kExactFifth, 10 * exponent_);
}

int DoubleKernel::orientation_exact(const Point& a, const Point& b, const Point& c,
                                    const Point& d) {
  std::array<IntKernel::Point, 4> integers;
  if (to_integers<4>({&a, &b, &c, &d}, integers))
    return IntKernel::orientation(integers[0], integers[1], integers[2], integers[3]);
  return Epick().orientation_3_object()(cgal(a), cgal(b), cgal(c), cgal(d));
}

bool DoubleKernel::collinear(const Point& a, const Point& b, const Point& c) {
  // The points are collinear if and only if all three projections are.
  using Planar = planar::DoubleKernel;
  return Planar::orientation({a[0], a[1]}, {b[0], b[1]}, {c[0], c[1]}) == 0 &&
         Planar::orientation({a[1], a[2]}, {b[1], b[2]}, {c[1], c[2]}) == 0 &&
         Planar::orientation({a[2], a[0]}, {b[2], b[0]}, {c[2], c[0]}) == 0;
}

int DoubleKernel::in_sphere(const Point& a, const Point& b, const Point& c, const Point& d,
                            const Point& p) {
  std::array<IntKernel::Point, 5> integers;
  if (to_integers<5>({&a, &b, &c, &d, &p}, integers))
    return IntKernel::in_sphere(integers[0], integers[1], integers[2], integers[3], integers[4]);
  return Epick().side_of_oriented_sphere_3_object()(cgal(a), cgal(b), cgal(c), cgal(d), cgal(p));
}

int DoubleKernel::compare_distance(const Point& p, const Point& a, const Point& b) {
  return Epick().compare_distance_3_object()(cgal(p), cgal(a), cgal(b));
}

}  // namespace terrace::tri::spatial
