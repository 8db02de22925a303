// SPDX-License-Identifier: Apache-2.0
#include "gabriel.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

namespace terrace::tri::shape {
namespace {

using Epick = CGAL::Exact_predicates_inexact_constructions_kernel;

/// A difference of integers. Ties are frequent on grids and must be cheap.
struct IntVector {
  std::int64_t x, y, z;
};

bool small_difference(const Vector3& p, const Vector3& a, IntVector& result) {
  constexpr double kLimit = 0x1p18, kMaxCoordinate = 0x1p52;
  std::array<std::int64_t, 3> v{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double difference = p[k] - a[k];
    if (!(std::abs(p[k]) < kMaxCoordinate && std::abs(a[k]) < kMaxCoordinate &&
          std::abs(difference) < kLimit))
      return false;
    const auto int_p = static_cast<std::int64_t>(p[k]), int_a = static_cast<std::int64_t>(a[k]);
    if (static_cast<double>(int_p) != p[k] || static_cast<double>(int_a) != a[k]) return false;
    v[k] = int_p - int_a;
  }
  result = {v[0], v[1], v[2]};
  return true;
}

__extension__ using Wide = __int128;

std::int64_t dot(const IntVector& a, const IntVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Wide dot_wide(const IntVector& a, const IntVector& b) {
  return Wide{a.x} * b.x + Wide{a.y} * b.y + Wide{a.z} * b.z;
}
IntVector cross(const IntVector& a, const IntVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Differences are below 2^18, so n is below 2^37, n x b below 2^56, and the two sides below 2^115.
bool in_smallest_sphere_int(const IntVector& b, const IntVector& c, const IntVector& d) {
  const std::int64_t bb = dot(b, b), cc = dot(c, c), bc = dot(b, c), dd = dot(d, d);
  if (bc <= 0) return dd - dot(d, b) - dot(d, c) + bc < 0;
  if (bb <= bc) return dd - dot(d, c) < 0;
  if (cc <= bc) return dd - dot(d, b) < 0;
  const IntVector n = cross(b, c);
  return Wide{dd} * dot_wide(n, n) <
         Wide{cc} * dot_wide(d, cross(n, b)) + Wide{bb} * dot_wide(d, cross(c, n));
}

}  // namespace

bool in_smallest_sphere_exactly(const Vector3& pa, const Vector3& pb, const Vector3& pc,
                                const Vector3& pd) {
  IntVector wb{}, wc{}, wd{};
  if (small_difference(pb, pa, wb) && small_difference(pc, pa, wc) && small_difference(pd, pa, wd))
    return in_smallest_sphere_int(wb, wc, wd);
  const auto cgal = [](const Vector3& p) { return Epick::Point_3(p[0], p[1], p[2]); };
  const Epick::Point_3 a = cgal(pa), b = cgal(pb), c = cgal(pc), d = cgal(pd);
  const Epick kernel;
  const auto angle = kernel.angle_3_object();
  const auto side = kernel.side_of_bounded_sphere_3_object();
  // At a right angle both spheres coincide.
  if (angle(b, a, c) != CGAL::ACUTE) return side(b, c, d) == CGAL::ON_BOUNDED_SIDE;
  if (angle(a, b, c) != CGAL::ACUTE) return side(a, c, d) == CGAL::ON_BOUNDED_SIDE;
  if (angle(a, c, b) != CGAL::ACUTE) return side(a, b, d) == CGAL::ON_BOUNDED_SIDE;
  return side(a, b, c, d) == CGAL::ON_BOUNDED_SIDE;
}

}  // namespace terrace::tri::shape
