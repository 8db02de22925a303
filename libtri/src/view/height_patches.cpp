// SPDX-License-Identifier: Apache-2.0
#include "height_patches.hpp"

#include <algorithm>
#include <limits>

namespace terrace::tri {
namespace {

constexpr std::uint32_t kLeaf = 4;
// A point is in a triangle if no barycentric coordinate is less than minus this: a point on an edge
// must not fall between two triangles.
constexpr double kRounding = 1e-9;

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

// Halves at the median along the longer side of the bounding box of the centres; boxes are computed
// bottom-up.
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
  std::array<std::uint32_t, 64> stack;  // enough for a balanced tree
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
      // At a corner exactly the corner's own height.
      result = u == 1.0 ? a[2] : v == 1.0 ? b[2] : w == 1.0 ? c[2] : u * a[2] + v * b[2] + w * c[2];
      if (least > 0.0) return result;  // inside; no other triangle contains it
    }
  }
  return result;
}

}  // namespace terrace::tri
