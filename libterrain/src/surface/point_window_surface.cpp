// SPDX-License-Identifier: Apache-2.0
// What lies between the points of a window.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include <terrace/tri/interpolation.hpp>

#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

using Corner = PointWindow::Corner;

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

PointWindow::Corner PointWindow::corner(tri::VertexId vertex) const {
  return {triangulation_.point(vertex), height(vertex)};
}

std::array<PointWindow::Corner, 3> PointWindow::corners_with_heights(tri::TriangleId t) const {
  const auto v = triangulation_.vertices(t);
  return {corner(v[0]), corner(v[1]), corner(v[2])};
}

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

bool PointWindow::is_surface(tri::TriangleId triangle) const {
  if (!too_long_) return true;
  const std::array<Point2, 3> p = corners(triangle);
  return !too_long_(p[0], p[1]) && !too_long_(p[1], p[2]) && !too_long_(p[2], p[0]);
}

SurfacePoint PointWindow::at(const Point2& place) const {
  if (triangulation_.vertex_count() == 0) return {};
  if (triangulation_.triangle_count() == 0) {
    std::vector<tri::VertexWeight> weights;
    tri::weights_at(triangulation_, place, tri::Interpolation::kLinear, weights);
    SurfacePoint result;
    if (weights.size() == 1) result.height = height(weights[0].vertex);
    if (weights.size() == 2) {
      const Corner a = corner(weights[0].vertex), b = corner(weights[1].vertex);
      if (!too_long_ || !too_long_(a.place, b.place)) result.height = on_edge(a, b, place);
    }
    return result;
  }
  const tri::Location found = triangulation_.locate(place, hints_[hint_cell(place)]);
  switch (found.place) {
    case tri::Place::kVertex:
      return at_vertex(found.vertex, found.triangle);
    case tri::Place::kEdge:
      return at_edge(found.triangle, found.edge, place);
    case tri::Place::kInside:
      if (!is_surface(found.triangle)) return {};
      return on_plane(corners_with_heights(found.triangle), place);
    case tri::Place::kOutside:
      break;
  }
  return {};
}

bool PointWindow::is_on_edge(const Point2& place) const {
  if (triangulation_.triangle_count() == 0) return false;
  return triangulation_.locate(place, hints_[hint_cell(place)]).place == tri::Place::kEdge;
}

SurfacePoint PointWindow::at_edge(tri::TriangleId triangle, std::size_t edge,
                                  const Point2& place) const {
  const auto v = triangulation_.vertices(triangle);
  const Corner a = corner(v[(edge + 1) % 3]), b = corner(v[(edge + 2) % 3]);
  if (too_long_ && too_long_(a.place, b.place)) return {};
  SurfacePoint result{on_edge(a, b, place)};
  double per_column = 0, per_row = 0;
  int count = 0;
  for (const tri::TriangleId t : {triangle, triangulation_.neighbours(triangle)[edge]}) {
    if (t == tri::kNoTriangle || !is_surface(t)) continue;
    const SurfacePoint one = on_plane(corners_with_heights(t), place);
    per_column += one.per_column;
    per_row += one.per_row;
    ++count;
  }
  if (count > 0) {
    result.per_column = per_column / count;
    result.per_row = per_row / count;
  }
  return result;
}

SurfacePoint PointWindow::at_vertex(tri::VertexId vertex, tri::TriangleId triangle) const {
  // The triangles round it. They are added up in an order of their own.
  std::vector<std::pair<std::array<Point2, 3>, SurfacePoint>> round;
  const auto add = [&](tri::TriangleId t) {
    if (!is_surface(t)) return;
    std::array<Point2, 3> key = corners(t);
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    round.emplace_back(key, on_plane(corners_with_heights(t), triangulation_.point(vertex)));
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
  SurfacePoint result{height(vertex)};
  if (round.empty()) return result;
  std::sort(round.begin(), round.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  double per_column = 0, per_row = 0;
  for (const auto& [key, one] : round) {
    per_column += one.per_column;
    per_row += one.per_row;
  }
  const auto count = static_cast<double>(round.size());
  result.per_column = per_column / count;
  result.per_row = per_row / count;
  return result;
}

}  // namespace terrace::terrain
