// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "points.hpp"
#include "terrace/tri/interpolation.hpp"

/// Queries of all kinds for the tests of interpolation.

namespace terrace::tri {

template <class Coord>
Point2 query_at(const Delaunay2<Coord>& triangulation, VertexId v) {
  const auto p = triangulation.point(v);
  return {static_cast<double>(p[0]), static_cast<double>(p[1])};
}

/// Queries anywhere in the bounding box and beyond, on vertices and one rounding away from them, on
/// edges (or as close as doubles allow), close to the hull, and on points cocircular with others.
template <class Coord>
std::vector<Point2> make_queries(const Delaunay2<Coord>& triangulation, std::size_t count,
                                 std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point2> vertices;
  for (const VertexId v : triangulation.all_vertices())
    vertices.push_back(query_at(triangulation, v));
  if (vertices.empty()) return {{0, 0}, {1, 2}};
  std::vector<TriangleId> triangles;
  for (const TriangleId t : triangulation.all_triangles()) triangles.push_back(t);
  const auto random_vertex = [&] { return vertices[random() % vertices.size()]; };
  const auto mix = [](const Point2& a, const Point2& b, double part) {
    return Point2{a[0] * (1 - part) + b[0] * part, a[1] * (1 - part) + b[1] * part};
  };
  std::vector<Point2> queries;
  for (std::size_t i = 0; i < count; ++i) {
    Point2 p = mix(random_vertex(), random_vertex(), to_unit(random()));
    const double tiny = std::ldexp(1.0, -static_cast<int>(random() % 50));
    switch (i % 7) {
      case 0:
        p = mix(p, random_vertex(), to_unit(random()));
        break;
      case 1:
        p = random_vertex();
        if (random() % 2 == 0) break;
        for (double& c : p)
          c = std::nextafter(c, random() % 2 == 0 ? -std::numeric_limits<double>::infinity()
                                                  : std::numeric_limits<double>::infinity());
        break;
      case 2:
        p = mix(p, random_vertex(), tiny);  // near an edge or diagonal
        break;
      case 3:
        p = {random_vertex()[0],
             random_vertex()[1]};  // cocircular or collinear with vertices of a raster
        break;
      default:
        if (triangles.empty()) break;
        const TriangleId t = triangles[random() % triangles.size()];
        const auto corner = triangulation.vertices(t);
        const Point2 a = query_at(triangulation, corner[random() % 3]);
        const Point2 b = query_at(triangulation, corner[random() % 3]);
        p = mix(a, b, i % 2 == 0 ? 0.5 : to_unit(random()));
        if (i % 7 == 4) break;
        p = mix(p, query_at(triangulation, corner[random() % 3]), i % 7 == 5 ? 0.3 : tiny);
    }
    if (std::isfinite(p[0]) && std::isfinite(p[1])) queries.push_back(p);
  }
  return queries;
}

}  // namespace terrace::tri
