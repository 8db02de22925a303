// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/geomorph.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace terrace::tri {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;
constexpr std::uint32_t kLeaf = 4;
// A point is in a triangle if no barycentric coordinate is less than minus this: what lies on an
// edge must not fall between two triangles.
constexpr double kRounding = 1e-9;

template <class Coord>
Point3 lifted(const std::array<Coord, 2>& point, double height) {
  return {static_cast<double>(point[0]), static_cast<double>(point[1]), height};
}

double doubled_area(const Point3& a, const Point3& b, double x, double y) {
  return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

}  // namespace

void HeightPatches::build() {
  nodes_.clear();
  if (triangles_.empty()) return;
  nodes_.reserve(triangles_.size() + 1);
  nodes_.emplace_back();
  places_.clear();
  for (const auto& [a, b, c] : triangles_) {
    places_.push_back(
        {a[0] + b[0] + c[0], a[1] + b[1] + c[1], static_cast<std::uint32_t>(places_.size())});
  }
  split(0, 0, static_cast<std::uint32_t>(triangles_.size()));
  sorted_.clear();
  for (const Place& place : places_) sorted_.push_back(triangles_[place.triangle]);
  triangles_.swap(sorted_);
}

// Halves at the median along the longer side of what the middles span; boxes come from below.
void HeightPatches::split(std::uint32_t node, std::uint32_t first, std::uint32_t last) {
  const double infinity = std::numeric_limits<double>::infinity();
  std::array<double, 4> box{infinity, infinity, -infinity, -infinity};
  const auto add = [&box](double x, double y) {
    box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
  };
  if (last - first <= kLeaf) {
    for (std::uint32_t i = first; i < last; ++i) {
      for (const Corner& corner : triangles_[places_[i].triangle]) add(corner[0], corner[1]);
    }
    nodes_[node] = {box, first, last - first};
    return;
  }
  for (std::uint32_t i = first; i < last; ++i) add(places_[i].x, places_[i].y);
  const bool by_x = box[2] - box[0] >= box[3] - box[1];
  const std::uint32_t middle = first + (last - first) / 2;
  const auto at = [&](std::uint32_t i) { return places_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last),
                   [by_x](const Place& a, const Place& b) { return by_x ? a.x < b.x : a.y < b.y; });
  const auto below = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  split(below, first, middle);
  split(below + 1, middle, last);
  const auto& left = nodes_[below].box;
  const auto& right = nodes_[below + 1].box;
  nodes_[node] = {{std::min(left[0], right[0]), std::min(left[1], right[1]),
                   std::max(left[2], right[2]), std::max(left[3], right[3])},
                  below,
                  0};
}

std::optional<double> HeightPatches::height(double x, double y) const {
  std::optional<double> result;
  if (nodes_.empty()) return result;
  double best = -kRounding;
  std::array<std::uint32_t, 64> stack;  // of a balanced tree
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (x < node.box[0] || y < node.box[1] || x > node.box[2] || y > node.box[3]) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const auto& [a, b, c] = triangles_[i];
      const double area = doubled_area(a, b, c[0], c[1]);
      if (!(area > 0.0)) continue;
      const double u = doubled_area(b, c, x, y) / area, v = doubled_area(c, a, x, y) / area;
      const double w = doubled_area(a, b, x, y) / area;
      const double least = std::min({u, v, w});
      if (!(least >= best) || (result && least == best)) continue;
      best = least;
      // At a corner the corner's own height, exactly.
      result = u == 1.0 ? a[2] : v == 1.0 ? b[2] : w == 1.0 ? c[2] : u * a[2] + v * b[2] + w * c[2];
      if (least > 0.0) return result;  // inside; no other one holds it
    }
  }
  return result;
}

template <class Coord>
Point3 Geomorph2<Coord>::old_position(const Model& model, VertexId vertex) const {
  const std::uint32_t at = slot(vertex);
  if (at < old_index_.size() && old_index_[at] != kNone) return old_positions_[old_index_[at]];
  return lifted(model.triangulation().point(vertex), model.height(vertex));
}

template <class Coord>
void Geomorph2<Coord>::make(const Model& model, const typename Model::Delta& delta) {
  const auto& changes = delta.changes;
  if (delta.removed_heights.size() != changes.removed_vertices.size() ||
      delta.reassigned_heights.size() != delta.reassigned.size()) {
    throw std::invalid_argument(
        "geomorph: the delta does not tell old heights; make the model with old_heights");
  }
  added.clear();
  removed.clear();
  reassigned.clear();
  const Delaunay2<Coord>& now = model.triangulation();

  old_index_.resize(std::max<std::size_t>(old_index_.size(), now.vertex_slots()), kNone);
  const auto remember = [&](VertexId vertex, const Point3& position) {
    old_index_[slot(vertex)] = static_cast<std::uint32_t>(old_positions_.size());
    old_positions_.push_back(position);
  };
  for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
    remember(changes.removed_vertices[i],
             lifted(changes.removed_points[i], delta.removed_heights[i]));
  }
  for (std::size_t i = 0; i < delta.reassigned.size(); ++i) {
    const VertexId vertex = delta.reassigned[i];
    const Point3 before = lifted(now.point(vertex), delta.reassigned_heights[i]);
    remember(vertex, before);
    reassigned.add(vertex, before, lifted(now.point(vertex), model.height(vertex)));
  }

  // A new vertex lies in a triangle that it destroyed, or outside the old hull.
  patches_.clear();
  for (const std::array<VertexId, 3>& corners : changes.removed_corners) {
    patches_.add(old_position(model, corners[0]), old_position(model, corners[1]),
                 old_position(model, corners[2]));
  }
  patches_.build();
  for (const VertexId vertex : changes.added_vertices) {
    const Point3 end = lifted(now.point(vertex), model.height(vertex));
    Point3 start = end;
    start[2] = patches_.height(end[0], end[1]).value_or(end[2]);
    added.add(vertex, start, end);
  }

  patches_.clear();
  for (const TriangleId triangle : changes.added_triangles) {
    const std::array<VertexId, 3> corners = now.vertices(triangle);
    const auto position = [&](std::size_t i) {
      return lifted(now.point(corners[i]), model.height(corners[i]));
    };
    patches_.add(position(0), position(1), position(2));
  }
  patches_.build();
  for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
    const Point3 start = lifted(changes.removed_points[i], delta.removed_heights[i]);
    Point3 end = start;
    end[2] = patches_.height(start[0], start[1]).value_or(start[2]);
    removed.add(changes.removed_vertices[i], start, end);
  }

  for (const VertexId vertex : changes.removed_vertices) old_index_[slot(vertex)] = kNone;
  for (const VertexId vertex : delta.reassigned) old_index_[slot(vertex)] = kNone;
  old_positions_.clear();
}

template class Geomorph2<std::int32_t>;
template class Geomorph2<double>;

}  // namespace terrace::tri
