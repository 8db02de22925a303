// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "../delaunay3/elliptical_kernel.hpp"

/// Decides whether a point is inside the smallest sphere that contains a triangle. Exact: uses
/// doubles with an error bound, and exact numbers if the bound does not decide.

namespace terrace::tri::shape {

/// Requires a, b, c not collinear and d different from them. Exact for all finite coordinates.
bool in_smallest_sphere_exactly(const std::array<double, 3>& a, const std::array<double, 3>& b,
                                const std::array<double, 3>& c, const std::array<double, 3>& d);

template <class Point>
std::array<double, 3> to_doubles(const Point& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

using Vector3 = std::array<double, 3>;

inline Vector3 minus(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double largest(const Vector3& a) {
  return std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[2])});
}

/// Returns 1 if d is inside the smallest sphere of the origin, b, c, -1 if not, and 0 if unknown.
/// The vectors are differences of doubles, with an additional error of 9 u spread times their
/// lengths.
inline int filter_smallest_sphere(const Vector3& b, const Vector3& c, const Vector3& d,
                                  double spread = 0.0) {
  const double m = std::max({largest(b), largest(c), largest(d)});
  // Outside these limits a term below could overflow, or underflow in a way that matters.
  if (!(m > 0x1p-120 && m < 0x1p160)) [[unlikely]]
    return 0;

  // A sum of products of two differences of at most m: three for each of bb, cc and twice as many
  // for the rest. Every product and partial sum is rounded, and so are differences of doubles. The
  // total of the absolute products is below 12 m^2 in every case, each with at most 8 roundings.
  // Scalar products of vectors of at most 3^0.5 m, each with an error of e, have an error of 2 e
  // 3^0.5 m. There are four.
  const double bound2 = (12 * 8 + 240 * spread) * 0x1p-53 * (m * m);
  const double bb = dot(b, b), cc = dot(c, c), bc = dot(b, c);
  const double at_b = bb - bc, at_c = cc - bc;  // cosines at a, b and c up to a positive factor
  // If an angle is obtuse, the sphere is the one on the opposite edge. The product of the vectors
  // from d to its ends is negative inside.
  const double dd = dot(d, d);
  double product = 0.0;
  if (bc < -bound2) {
    product = dd - dot(d, b) - dot(d, c) + bc;  // (d - b)(d - c)
  } else if (at_b < -bound2) {
    product = dd - dot(d, c);  // d (d - c)
  } else if (at_c < -bound2) {
    product = dd - dot(d, b);  // d (d - b)
  } else if (bc > bound2 && at_b > bound2 && at_c > bound2) {
    // The circumcentre is w / (2 n^2), and d is inside its sphere if d^2 < 2 d w / (2 n^2).
    // Everything is a sum of products of six differences, of at most 108 m^6 together, each with at
    // most 24 roundings. Three products of six vectors, each with an error of e, have an error of
    // 18 e 3^2.5 m^5.
    const Vector3 n = cross(b, c);
    const Vector3 nb = cross(n, b), cn = cross(c, n);
    const double dw = cc * dot(d, nb) + bb * dot(d, cn);
    const double power = dd * dot(n, n) - dw;
    const double bound6 = (108 * 24 + 4800 * spread) * 0x1p-53 * (m * m * m) * (m * m * m);
    return power < -bound6 ? 1 : power > bound6 ? -1 : 0;
  } else {
    return 0;
  }
  return product < -bound2 ? 1 : product > bound2 ? -1 : 0;
}

/// True if d is inside the smallest sphere of a, b, c.
template <class Coord>
bool in_smallest_sphere(const std::array<Coord, 3>& pa, const std::array<Coord, 3>& pb,
                        const std::array<Coord, 3>& pc, const std::array<Coord, 3>& pd) {
  const Vector3 origin = to_doubles(pa);
  const int side = filter_smallest_sphere(
      minus(to_doubles(pb), origin), minus(to_doubles(pc), origin), minus(to_doubles(pd), origin));
  if (side != 0) [[likely]]
    return side > 0;
  return in_smallest_sphere_exactly(origin, to_doubles(pb), to_doubles(pc), to_doubles(pd));
}

/// The same in the elliptical metric of the scope.
inline bool in_smallest_ellipsoid(const Vector3& a, const Vector3& b, const Vector3& c,
                                  const Vector3& d) {
  using Kernel = spatial::EllipticalKernel;
  const double spread = Kernel::form().spread();
  const int side = spread < 0x1p28
                       ? filter_smallest_sphere(Kernel::mapped(b, a), Kernel::mapped(c, a),
                                                Kernel::mapped(d, a), spread)
                       : 0;
  return side != 0 ? side > 0 : Kernel::in_smallest_sphere(a, b, c, d);
}

}  // namespace terrace::tri::shape
