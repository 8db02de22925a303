// SPDX-License-Identifier: Apache-2.0
// The surface between the points of a window.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include <terrace/tri/interpolation.hpp>

#include "surface/point_window.hpp"

namespace terrace::terrain {
SurfaceCorner PointWindow::corner(tri::VertexId vertex) const {
  return {triangulation_.point(vertex), height(vertex)};
}

SurfaceTriangle PointWindow::corners_with_heights(tri::TriangleId t) const {
  const auto v = triangulation_.vertices(t);
  return {corner(v[0]), corner(v[1]), corner(v[2])};
}

void PointWindow::make_hints() {
  has_triangles_ = triangulation_.triangle_count() > 0;
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
  // A cell without a hint gets that of the previous cell.
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

SurfacePoint PointWindow::at(const Point2& place, tri::VertexId& near) const {
  if (triangulation_.vertex_count() == 0) return {};
  if (!has_triangles_) {
    std::vector<tri::VertexWeight> weights;
    tri::weights_at(triangulation_, place, tri::Interpolation::kLinear, weights);
    SurfacePoint result;
    if (weights.size() == 1) result.height = height(weights[0].vertex);
    if (weights.size() == 2) {
      const SurfaceCorner a = corner(weights[0].vertex), b = corner(weights[1].vertex);
      if (!too_long_ || !too_long_(a.place, b.place)) result.height = on_edge(a, b, place);
    }
    return result;
  }
  const tri::VertexId hint = near == tri::kNoVertex ? hints_[hint_cell(place)] : near;
  const tri::Location found = triangulation_.locate(place, hint);
  near = found.vertex;
  switch (found.place) {
    case tri::Place::kVertex:
      return at_vertex(found.vertex, found.triangle);
    case tri::Place::kEdge:
      return at_edge(found.triangle, found.edge, place);
    case tri::Place::kInside: {
      const SurfaceTriangle triangle = corners_with_heights(found.triangle);
      return is_surface(triangle, too_long_) ? on_plane(triangle, place) : SurfacePoint{};
    }
    case tri::Place::kOutside:
      break;
  }
  return {};
}

bool PointWindow::is_on_edge(const Point2& place) const {
  if (!has_triangles_) return false;
  return triangulation_.locate(place, hints_[hint_cell(place)]).place == tri::Place::kEdge;
}

SurfacePoint PointWindow::at_edge(tri::TriangleId triangle, std::size_t edge,
                                  const Point2& place) const {
  const auto v = triangulation_.vertices(triangle);
  const SurfaceCorner a = corner(v[(edge + 1) % 3]), b = corner(v[(edge + 2) % 3]);
  if (too_long_ && too_long_(a.place, b.place)) return {};
  std::vector<SurfaceTriangle> sides;
  for (const tri::TriangleId t : {triangle, triangulation_.neighbours(triangle)[edge]}) {
    if (t != tri::kNoTriangle) sides.push_back(corners_with_heights(t));
  }
  return where_triangles_meet(place, on_edge(a, b, place), sides, too_long_);
}

SurfacePoint PointWindow::at_vertex(tri::VertexId vertex, tri::TriangleId triangle) const {
  std::vector<SurfaceTriangle> round;
  const auto turn = [&](tri::TriangleId t, std::size_t by) {
    const auto v = triangulation_.vertices(t);
    const std::size_t i = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
    return triangulation_.neighbours(t)[(i + by) % 3];
  };
  tri::TriangleId t = triangle;
  do {
    round.push_back(corners_with_heights(t));
    t = turn(t, 1);
  } while (t != triangle && t != tri::kNoTriangle);
  if (t == tri::kNoTriangle) {  // met the hull: go the other way for the rest
    for (t = turn(triangle, 2); t != tri::kNoTriangle; t = turn(t, 2)) {
      round.push_back(corners_with_heights(t));
    }
  }
  return where_triangles_meet(triangulation_.point(vertex), height(vertex), round, too_long_);
}

}  // namespace terrace::terrain
