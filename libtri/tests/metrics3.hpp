// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <CGAL/Exact_rational.h>

#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/metric.hpp"

/// Metrics of space for the tests, and their definition in rational numbers.

namespace terrace::tri::test {

using Elliptical3 = Delaunay3<double, EllipticalMetric3>;

using Space = std::array<double, 3>;
using Corners3 = std::array<Space, 4>;

/// Maps that keep the lexicographic order, so that ties of mapped points are broken in the same
/// way. Every metric has one such map.
inline const std::vector<LinearMap3>& lower_maps3() {
  static const std::vector<LinearMap3> maps{{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                            {1, 0, 0, 0, 3, 0, 0, 0, 0.25},
                                            {0.1, 0, 0, 0.7, 0.3, 0, -0.2, 0.1, 2},
                                            {5, 0, 0, -4, 0.5, 0, 3, 1, 1},
                                            {1e-3, 0, 0, 2, 1e3, 0, 7, -5, 1},
                                            {1e-200, 0, 0, 1e-200, 2e-200, 0, 3e-200, 0, 1e-200}};
  return maps;
}

/// Rotations with rational entries, not all of which are doubles, and one that permutes the axes.
inline const std::vector<LinearMap3>& rotations() {
  static const std::vector<LinearMap3> axes{
      kIdentityMap<3>,
      {0, 1, 0, 0, 0, 1, 1, 0, 0},
      {0.6, 0.8, 0, -0.8, 0.6, 0, 0, 0, 1},
      {2.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3, 2.0 / 3, -1.0 / 3, -1.0 / 3, 2.0 / 3, 2.0 / 3},
      {2.0 / 7, 3.0 / 7, 6.0 / 7, 6.0 / 7, 2.0 / 7, -3.0 / 7, -3.0 / 7, 6.0 / 7, -2.0 / 7}};
  return axes;
}

using Rational = CGAL::Exact_rational;
using Rationals = std::array<Rational, 3>;

inline Rationals exact_difference(const Space& to, const Space& from) {
  return {Rational(to[0]) - Rational(from[0]), Rational(to[1]) - Rational(from[1]),
          Rational(to[2]) - Rational(from[2])};
}

inline Rationals mapped_by(const LinearMap3& m, const Rationals& v) {
  Rationals result;
  for (std::size_t r = 0; r < 3; ++r)
    result[r] =
        Rational(m[3 * r]) * v[0] + Rational(m[3 * r + 1]) * v[1] + Rational(m[3 * r + 2]) * v[2];
  return result;
}

inline Rational product(const Rationals& u, const Rationals& v) {
  return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

/// |M v|^2.
inline Rational square(const LinearMap3& m, const Rationals& v) {
  const Rationals mapped = mapped_by(m, v);
  return product(mapped, mapped);
}

inline Rational determinant(const Rationals& a, const Rationals& b, const Rationals& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// 1 if p is inside the ellipsoid through the four corners, 0 if on it, -1 if outside. The corners,
/// which are not coplanar, may have any order.
inline int in_ellipsoid(const LinearMap3& m, const Corners3& corners, const Space& p) {
  std::array<Rationals, 4> d;
  std::array<Rational, 4> s;
  for (std::size_t i = 0; i < 4; ++i) {
    d[i] = exact_difference(corners[i], p);
    s[i] = square(m, d[i]);
  }
  // Barycentric coordinates of p times the volume. Weighted with these, the squared distances of
  // the corners add up to the power of p.
  const Rational w0 = determinant(d[1], d[2], d[3]), w1 = determinant(d[0], d[2], d[3]),
                 w2 = determinant(d[0], d[1], d[3]), w3 = determinant(d[0], d[1], d[2]);
  const Rational volume = w0 - w1 + w2 - w3;
  const Rational sum = w0 * s[0] - w1 * s[1] + w2 * s[2] - w3 * s[3];
  return static_cast<int>(CGAL::sign(sum)) * static_cast<int>(CGAL::sign(volume));
}

template <class Triangulation>
std::vector<Corners3> tetrahedra_of(const Triangulation& triangulation) {
  std::vector<Corners3> result;
  for (const TetrahedronId id : triangulation.all_tetrahedra()) {
    Corners3 corners;
    const auto vertices = triangulation.vertices(id);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = triangulation.point(vertices[i]);
      for (std::size_t k = 0; k < 3; ++k) corners[i][k] = static_cast<double>(p[k]);
    }
    std::sort(corners.begin(), corners.end());
    result.push_back(corners);
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace terrace::tri::test
