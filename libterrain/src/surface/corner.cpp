// SPDX-License-Identifier: Apache-2.0
#include "surface/corner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

namespace terrace::terrain {
namespace {

bool before(const SurfaceCorner& a, const SurfaceCorner& b) { return a.place < b.place; }

/// As on_plane(), with a bounded error for thin triangles, see weights_at().
SurfacePoint on_needle(const SurfaceTriangle& corner, const Point2& place) {
  tri::Delaunay2<double> alone;
  std::vector<double> heights;
  for (const SurfaceCorner& c : corner) {
    const tri::VertexId v = alone.insert(c.place).vertex;
    heights.resize(alone.vertex_slots());
    heights[tri::slot(v)] = c.height;
  }
  const std::array<Point2, 1> places{place};
  const double height = tri::heights_at(alone, heights, places, tri::Interpolation::linear, 1)[0];
  const tri::Gradient gradient =
      tri::gradients_at(alone, heights, places, tri::GradientFrom::triangles, 1)[0];
  return {height, gradient.x, gradient.y};
}

}  // namespace

// The lexicographically smallest corner comes first, so that a triangle always gives the same bits.
SurfacePoint on_plane(SurfaceTriangle triangle, const Point2& place) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end(), before),
              triangle.end());
  const auto& [a, b, c] = triangle;
  const double ux = b.place[0] - a.place[0], uy = b.place[1] - a.place[1];
  const double vx = c.place[0] - a.place[0], vy = c.place[1] - a.place[1];
  const double first = ux * vy, second = uy * vx, area = first - second;
  constexpr double kGood = 1e-4;
  if (!(area > kGood * (std::abs(first) + std::abs(second))) || !(area > 1e-290)) {
    return on_needle(triangle, place);
  }
  const double hb = b.height - a.height, hc = c.height - a.height;
  SurfacePoint result;
  result.per_column = (hb * vy - hc * uy) / area;
  result.per_row = (hc * ux - hb * vx) / area;
  const double dx = place[0] - a.place[0], dy = place[1] - a.place[1];
  result.height = a.height + (hb * (dx * vy - dy * vx) + hc * (ux * dy - uy * dx)) / area;
  return result;
}

double on_edge(SurfaceCorner a, SurfaceCorner b, const Point2& place) {
  if (before(b, a)) std::swap(a, b);
  const double dx = b.place[0] - a.place[0], dy = b.place[1] - a.place[1];
  const double t =
      std::abs(dx) >= std::abs(dy) ? (place[0] - a.place[0]) / dx : (place[1] - a.place[1]) / dy;
  return a.height + t * (b.height - a.height);
}

SurfacePoint where_triangles_meet(const Point2& place, double height,
                                  std::span<SurfaceTriangle> triangles, const TooLong& too_long) {
  for (SurfaceTriangle& t : triangles) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end(), before), t.end());
  }
  // Add them in a canonical order.
  std::sort(triangles.begin(), triangles.end(),
            [](const SurfaceTriangle& s, const SurfaceTriangle& t) {
              for (std::size_t i = 0; i < 3; ++i) {
                if (s[i].place != t[i].place) return s[i].place < t[i].place;
              }
              return false;
            });
  double per_column = 0, per_row = 0, count = 0;
  for (const SurfaceTriangle& t : triangles) {
    if (!is_surface(t, too_long)) continue;
    const SurfacePoint one = on_plane(t, place);
    per_column += one.per_column;
    per_row += one.per_row;
    ++count;
  }
  SurfacePoint result{height};
  if (count > 0) {
    result.per_column = per_column / count;
    result.per_row = per_row / count;
  }
  return result;
}

}  // namespace terrace::terrain
