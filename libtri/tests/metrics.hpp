// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include <CGAL/Exact_rational.h>

#include "terrace/tri/metric.hpp"

/// Metrics for the tests, and their definition in rational numbers.

namespace terrace::tri::test {

using Elliptical2 = Delaunay2<double, EllipticalMetric2>;

using PlanePoint = std::array<double, 2>;
using Corners = std::array<PlanePoint, 3>;

/// Maps that keep the lexicographic order, so that ties of mapped points are broken in the same
/// way. Every metric has one such map.
inline const std::vector<LinearMap2>& lower_maps() {
  static const std::vector<LinearMap2> maps{{1, 0, 0, 1},       {1, 0, 0, 3},
                                            {0.1, 0, 0.7, 0.3}, {5, 0, -4, 0.5},
                                            {1e-3, 0, 2, 1e3},  {1e-200, 0, 1e-200, 2e-200}};
  return maps;
}

inline CGAL::Exact_rational square(const LinearMap2& m, const CGAL::Exact_rational& x,
                                   const CGAL::Exact_rational& y) {
  using Q = CGAL::Exact_rational;
  const Q u = Q(m[0]) * x + Q(m[1]) * y, v = Q(m[2]) * x + Q(m[3]) * y;
  return u * u + v * v;
}

/// 1 if p is inside the ellipse through the counter-clockwise a, b, c, 0 if on it, -1 if outside.
inline int in_ellipse(const LinearMap2& m, const PlanePoint& a, const PlanePoint& b,
                      const PlanePoint& c, const PlanePoint& p) {
  using Q = CGAL::Exact_rational;
  Q row[3][3];
  const PlanePoint* corner[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    row[i][0] = Q((*corner[i])[0]) - Q(p[0]);
    row[i][1] = Q((*corner[i])[1]) - Q(p[1]);
    row[i][2] = square(m, row[i][0], row[i][1]);
  }
  const auto minor = [&](int i, int k) -> Q {
    return row[i][0] * row[k][1] - row[k][0] * row[i][1];
  };
  return static_cast<int>(
      CGAL::sign(Q(row[0][2] * minor(1, 2) + row[1][2] * minor(2, 0) + row[2][2] * minor(0, 1))));
}

inline Corners rotated(Corners t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

template <class Triangulation>
Corners corners_of(const Triangulation& triangulation, const std::array<VertexId, 3>& vertices) {
  Corners t;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto p = triangulation.point(vertices[i]);
    t[i] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
  }
  return rotated(t);
}

template <class Triangulation>
std::vector<Corners> triangles_of(const Triangulation& triangulation) {
  std::vector<Corners> result;
  for (const TriangleId id : triangulation.all_triangles())
    result.push_back(corners_of(triangulation, triangulation.vertices(id)));
  std::sort(result.begin(), result.end());
  return result;
}

/// Three boxes with different ellipses within the bounding box of the points, two of them
/// overlapping.
template <class Coord>
MetricField2 three_regions(const std::vector<std::array<Coord, 2>>& points) {
  PlanePoint low{}, high{};
  for (std::size_t k = 0; k < 2; ++k) {
    low[k] = high[k] = static_cast<double>(points[0][k]);
    for (const auto& p : points) {
      low[k] = std::min(low[k], static_cast<double>(p[k]));
      high[k] = std::max(high[k], static_cast<double>(p[k]));
    }
  }
  const auto box = [&](double x0, double y0, double x1, double y1) {
    const auto at = [&](std::size_t k, double part) { return low[k] + (high[k] - low[k]) * part; };
    return box2(at(0, x0), at(1, y0), at(0, x1), at(1, y1));
  };
  return MetricField2({{box(0, 0, 0.5, 0.6), ellipse_map(5, 1, 30)},
                       {box(0.4, 0.3, 1, 0.7), ellipse_map(1, 3, 0)},
                       {box(0.2, 0.7, 0.9, 1), ellipse_map(20, 1, -45)}});
}

}  // namespace terrace::tri::test
