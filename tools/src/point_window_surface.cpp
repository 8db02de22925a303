// SPDX-License-Identifier: GPL-3.0-or-later
// What lies between the points of a window.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include <terrace/tri/interpolation.hpp>

#include "point_window.hpp"

namespace terrace::tools {
namespace {

/// A point of the surface.
struct Corner {
  Point2 place;
  double height = 0;
};

bool before(const Corner& a, const Corner& b) { return a.place < b.place; }

/// The same by numbers whose error is bounded, see weights_at().
SurfacePoint on_needle(const std::array<Corner, 3>& corner, const Point2& place) {
  tri::Delaunay2<double> alone;
  std::vector<double> heights;
  for (const Corner& c : corner) {
    const tri::VertexId v = alone.insert(c.place).vertex;
    heights.resize(alone.vertex_slots());
    heights[tri::slot(v)] = c.height;
  }
  const std::array<Point2, 1> places{place};
  const double height = tri::heights_at(alone, heights, places, tri::Interpolation::kLinear, 1)[0];
  const tri::Gradient gradient =
      tri::gradients_at(alone, heights, places, tri::GradientFrom::kTriangles, 1)[0];
  return {height, gradient.x, gradient.y};
}

/// The plane through three corners. The lexicographically smallest is the first, so that the bits
/// are the triangle's own.
SurfacePoint on_plane(std::array<Corner, 3> corner, const Point2& place) {
  std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end(), before), corner.end());
  const auto& [a, b, c] = corner;
  const double ux = b.place[0] - a.place[0], uy = b.place[1] - a.place[1];
  const double vx = c.place[0] - a.place[0], vy = c.place[1] - a.place[1];
  const double first = ux * vy, second = uy * vx, area = first - second;
  constexpr double kGood = 1e-4;
  if (!(area > kGood * (std::abs(first) + std::abs(second))) || !(area > 1e-290)) {
    return on_needle(corner, place);
  }
  const double hb = b.height - a.height, hc = c.height - a.height;
  SurfacePoint result;
  result.per_column = (hb * vy - hc * uy) / area;
  result.per_row = (hc * ux - hb * vx) / area;
  const double dx = place[0] - a.place[0], dy = place[1] - a.place[1];
  result.height = a.height + (hb * (dx * vy - dy * vx) + hc * (ux * dy - uy * dx)) / area;
  return result;
}

/// Between the ends of an edge.
double on_edge(Corner a, Corner b, const Point2& place) {
  if (before(b, a)) std::swap(a, b);
  const double dx = b.place[0] - a.place[0], dy = b.place[1] - a.place[1];
  const double t =
      std::abs(dx) >= std::abs(dy) ? (place[0] - a.place[0]) / dx : (place[1] - a.place[1]) / dy;
  return a.height + t * (b.height - a.height);
}

}  // namespace

void PointWindow::make_hints() {
  constexpr std::size_t kMost = 1024;
  const auto side =
      static_cast<std::size_t>(std::sqrt(static_cast<double>(triangulation_.vertex_count()) / 2));
  hint_columns_ = hint_rows_ = static_cast<std::uint32_t>(std::clamp<std::size_t>(side, 1, kMost));
  hints_.assign(std::size_t{hint_columns_} * hint_rows_, tri::kNoVertex);
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = box_.max[k] - box_.min[k];
    hint_scale_[k] = size > 0 ? (k == 0 ? hint_columns_ : hint_rows_) / size : 0.0;
  }
  for (const tri::VertexId v : triangulation_.all_vertices()) {
    const Point2 p = triangulation_.point(v);
    if (box_.contains({p[0], p[1], 0})) hints_[hint_cell(p)] = v;
  }
  // What has none takes that of the cell before.
  tri::VertexId last = tri::kNoVertex;
  for (tri::VertexId& v : hints_) {
    if (v == tri::kNoVertex) v = last;
    last = v;
  }
}

std::size_t PointWindow::hint_cell(const Point2& place) const {
  const auto cell = [&](std::size_t k, std::uint32_t count) {
    const double at = (place[k] - box_.min[k]) * hint_scale_[k];
    return at > 0 ? std::min(static_cast<std::size_t>(std::min(at, 1e9)), std::size_t{count} - 1)
                  : std::size_t{0};
  };
  return cell(1, hint_rows_) * hint_columns_ + cell(0, hint_columns_);
}

SurfacePoint PointWindow::at(const Point2& place) const {
  if (triangulation_.vertex_count() == 0) return {};
  const auto corner = [&](tri::VertexId v) { return Corner{triangulation_.point(v), height(v)}; };
  const tri::VertexId near = hints_[hint_cell(place)];
  if (triangulation_.triangle_count() == 0) {
    std::vector<tri::VertexWeight> weights;
    tri::weights_at(triangulation_, place, tri::Interpolation::kLinear, weights);
    SurfacePoint result;
    if (weights.size() == 1) result.height = height(weights[0].vertex);
    if (weights.size() == 2) {
      result.height = on_edge(corner(weights[0].vertex), corner(weights[1].vertex), place);
    }
    return result;
  }
  const tri::Location found = triangulation_.locate(place, near);
  if (found.place == tri::Place::kOutside) return {};
  const auto v = triangulation_.vertices(found.triangle);
  const auto plane = [&](tri::TriangleId t) {
    const auto w = triangulation_.vertices(t);
    return on_plane({corner(w[0]), corner(w[1]), corner(w[2])}, place);
  };
  if (found.place == tri::Place::kInside) return plane(found.triangle);
  if (found.place == tri::Place::kEdge) {
    SurfacePoint result = plane(found.triangle);
    const tri::TriangleId other = triangulation_.neighbours(found.triangle)[found.edge];
    if (other != tri::kNoTriangle) {
      const SurfacePoint beyond = plane(other);
      result.per_column = 0.5 * (result.per_column + beyond.per_column);
      result.per_row = 0.5 * (result.per_row + beyond.per_row);
    }
    result.height =
        on_edge(corner(v[(found.edge + 1) % 3]), corner(v[(found.edge + 2) % 3]), place);
    return result;
  }
  return at_vertex(found.vertex, found.triangle);
}

SurfacePoint PointWindow::at_vertex(tri::VertexId vertex, tri::TriangleId triangle) const {
  // The triangles round it. They are added up in an order of their own.
  std::vector<std::pair<std::array<Point2, 3>, SurfacePoint>> round;
  const auto add = [&](tri::TriangleId t) {
    const auto v = triangulation_.vertices(t);
    std::array<Corner, 3> corner;
    std::array<Point2, 3> key;
    for (std::size_t k = 0; k < 3; ++k) corner[k] = {triangulation_.point(v[k]), height(v[k])};
    std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end(), before),
                corner.end());
    for (std::size_t k = 0; k < 3; ++k) key[k] = corner[k].place;
    round.emplace_back(key, on_plane(corner, triangulation_.point(vertex)));
  };
  const auto turn = [&](tri::TriangleId t, std::size_t by) {
    const auto v = triangulation_.vertices(t);
    const std::size_t i = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
    return triangulation_.neighbours(t)[(i + by) % 3];
  };
  tri::TriangleId t = triangle;
  do {
    add(t);
    t = turn(t, 1);
  } while (t != triangle && t != tri::kNoTriangle);
  if (t == tri::kNoTriangle) {  // met the hull: the other way for the rest
    for (t = turn(triangle, 2); t != tri::kNoTriangle; t = turn(t, 2)) add(t);
  }
  std::sort(round.begin(), round.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  SurfacePoint result{height(vertex), 0, 0};
  for (const auto& [key, one] : round) {
    result.per_column += one.per_column;
    result.per_row += one.per_row;
  }
  const auto count = static_cast<double>(round.size());
  result.per_column /= count;
  result.per_row /= count;
  return result;
}

}  // namespace terrace::tools
