// SPDX-License-Identifier: Apache-2.0
#include "base/region_overlap.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/polygon.hpp"

namespace terrace::terrain {
namespace {

using PlaneTriangle = std::array<Point2, 3>;

bool in_box(const Point2& p, const Point2& a, const Point2& b) {
  return std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= p[1] && p[1] <= std::max(a[1], b[1]);
}

/// Closed segments; touching counts.
bool cross(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const int abc = orientation(a, b, c), abd = orientation(a, b, d);
  const int cda = orientation(c, d, a), cdb = orientation(c, d, b);
  if (abc * abd < 0 && cda * cdb < 0) return true;
  return (abc == 0 && in_box(c, a, b)) || (abd == 0 && in_box(d, a, b)) ||
         (cda == 0 && in_box(a, c, d)) || (cdb == 0 && in_box(b, c, d));
}

bool holds(const PlaneTriangle& triangle, const Point2& p) {
  const int a = orientation(triangle[0], triangle[1], p);
  const int b = orientation(triangle[1], triangle[2], p);
  const int c = orientation(triangle[2], triangle[0], p);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

bool touches(const Polygon& polygon, const PlaneTriangle& triangle) {
  if (terrain::covers(polygon, triangle[0])) return true;
  for (const std::vector<Point2>& ring : polygon) {
    if (ring.empty()) continue;
    if (holds(triangle, ring[0])) return true;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Point2 &a = ring[i], &b = ring[(i + 1) % ring.size()];
      for (std::size_t k = 0; k < 3; ++k) {
        if (cross(a, b, triangle[k], triangle[(k + 1) % 3])) return true;
      }
    }
  }
  return false;
}

}  // namespace

bool touches(const Region& region, const std::array<stream::Point3, 3>& triangle) {
  stream::Box3 bounds;
  for (const stream::Point3& corner : triangle) bounds.include(corner);
  const stream::Box3& box = region.box();
  if (!bounds.intersects(box)) return false;
  const PlaneTriangle flat{{{triangle[0][0], triangle[0][1]},
                            {triangle[1][0], triangle[1][1]},
                            {triangle[2][0], triangle[2][1]}}};
  if (region.polygons().empty()) {
    return touches({{{box.min[0], box.min[1]},
                     {box.max[0], box.min[1]},
                     {box.max[0], box.max[1]},
                     {box.min[0], box.max[1]}}},
                   flat);
  }
  return std::any_of(region.polygons().begin(), region.polygons().end(),
                     [&flat](const Polygon& polygon) { return touches(polygon, flat); });
}

}  // namespace terrace::terrain
