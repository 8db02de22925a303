// SPDX-License-Identifier: Apache-2.0
#include "patches.hpp"

#include <algorithm>
#include <limits>

namespace terrace::tri {
namespace patches {
namespace {

// A point is in a triangle if no barycentric coordinate is less than minus this, so that a point on
// an edge does not fall between two triangles.
constexpr double kRounding = 1e-9;

double doubled_area(const Point3& a, const Point3& b, double x, double y) {
  return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point3 difference(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point3 point_on_line(const Point3& a, const Point3& direction, double share) {
  return {a[0] + share * direction[0], a[1] + share * direction[1], a[2] + share * direction[2]};
}
double squared_distance(const Point3& a, const Point3& b) {
  const Point3 d = difference(a, b);
  return dot(d, d);
}

Point3 nearest_on_edge(const Point3& a, const Point3& b, const Point3& p) {
  const Point3 ab = difference(b, a);
  const double length = dot(ab, ab), at = dot(ab, difference(p, a));
  if (!(at > 0.0)) return a;
  return at < length ? point_on_line(a, ab, at / length) : b;
}

/// Decides by the region of the triangle's plane that contains the projected place: C. Ericson,
/// Real-Time Collision Detection, section 5.1.5. If rounding leaves no region, or the triangle is
/// flat, returns the nearest place on an edge.
Point3 nearest_on_triangle(const Point3& a, const Point3& b, const Point3& c, const Point3& p) {
  const Point3 ab = difference(b, a), ac = difference(c, a), ap = difference(p, a);
  const double b1 = dot(ab, ap), c1 = dot(ac, ap);
  if (b1 <= 0.0 && c1 <= 0.0) return a;
  const double aa = dot(ab, ab), cc = dot(ac, ac), ab_ac = dot(ab, ac);
  const double b2 = b1 - aa, c2 = c1 - ab_ac;  // of p - b
  if (b2 >= 0.0 && c2 <= b2) return b;
  const double b3 = b1 - ab_ac, c3 = c1 - cc;  // of p - c
  if (c3 >= 0.0 && b3 <= c3) return c;
  const double of_c = b1 * c2 - b2 * c1, of_b = b3 * c1 - b1 * c3, of_a = b2 * c3 - b3 * c2;
  if (of_a > 0.0 && of_b > 0.0 && of_c > 0.0) {
    const double all = of_a + of_b + of_c, v = of_b / all, w = of_c / all;
    return {a[0] + v * ab[0] + w * ac[0], a[1] + v * ab[1] + w * ac[1],
            a[2] + v * ab[2] + w * ac[2]};
  }
  if (of_a > 0.0 && of_b > 0.0 && b1 > 0.0 && b2 < 0.0) return point_on_line(a, ab, b1 / (b1 - b2));
  if (of_a > 0.0 && of_c > 0.0 && c1 > 0.0 && c3 < 0.0) return point_on_line(a, ac, c1 / (c1 - c3));
  Point3 best = nearest_on_edge(b, c, p);
  double least = squared_distance(best, p);
  for (const Point3& other : {nearest_on_edge(a, b, p), nearest_on_edge(a, c, p)}) {
    const double distance = squared_distance(other, p);
    if (distance >= least) continue;
    least = distance;
    best = other;
  }
  return best;
}

}  // namespace
}  // namespace patches

template <std::size_t kAxes>
auto Patches<kAxes>::box_of(const Triangle& triangle) -> Box {
  const auto& [a, b, c] = triangle.corners;
  Box box;
  for (std::size_t k = 0; k < kAxes; ++k) {
    box.min[k] = std::min(std::min(a[k], b[k]), c[k]);
    box.max[k] = std::max(std::max(a[k], b[k]), c[k]);
  }
  return box;
}

/// Sorts by part, and within a part along a Z curve through the middles of the boxes.
template <std::size_t kAxes>
void Patches<kAxes>::sort() {
  constexpr unsigned kBits = 30 / kAxes;
  Box all;
  const auto middle = [](const Triangle& t, std::size_t k) {
    return t.corners[0][k] + t.corners[1][k] + t.corners[2][k];
  };
  for (const Triangle& t : triangles_) {
    for (std::size_t k = 0; k < kAxes; ++k) {
      all.min[k] = std::min(all.min[k], middle(t, k));
      all.max[k] = std::max(all.max[k], middle(t, k));
    }
  }
  double side = 0.0;
  for (std::size_t k = 0; k < kAxes; ++k) side = std::max(side, all.max[k] - all.min[k]);
  const double scale = side > 0.0 ? ((1u << kBits) - 1) / side : 0.0;
  keys_.clear();
  for (const Triangle& t : triangles_) {
    std::uint64_t key = t.part;
    std::array<std::uint32_t, kAxes> cell;
    for (std::size_t k = 0; k < kAxes; ++k) {
      cell[k] = static_cast<std::uint32_t>((middle(t, k) - all.min[k]) * scale);
    }
    for (unsigned bit = kBits; bit-- > 0;) {
      for (std::size_t k = 0; k < kAxes; ++k) key = 2 * key + (cell[k] >> bit & 1);
    }
    keys_.push_back({key, t.number});
  }
  std::sort(keys_.begin(), keys_.end());
  sorted_.clear();
  for (const auto& key : keys_) sorted_.push_back(triangles_[static_cast<std::size_t>(key[1])]);
  triangles_.swap(sorted_);
}

template <std::size_t kAxes>
void Patches<kAxes>::build(std::size_t parts) {
  nodes_.clear();
  parts_.assign(parts, {});
  sort();
  const auto size = static_cast<std::uint32_t>(triangles_.size());
  for (std::uint32_t first = 0, last = 0; first < size; first = last) {
    const std::uint32_t part = triangles_[first].part;
    while (last < size && triangles_[last].part == part) ++last;
    add_tree(first, last);
    parts_[part] = {static_cast<std::uint32_t>(nodes_.size() - 1), first};
  }
}

/// Adds the nodes level by level, the root last.
template <std::size_t kAxes>
void Patches<kAxes>::add_tree(std::uint32_t first, std::uint32_t last) {
  boxes_.clear();
  for (std::uint32_t t = first; t < last; ++t) boxes_.push_back(box_of(triangles_[t]));
  for (bool leaf = true; leaf || boxes_.size() > 1; leaf = false) {
    const auto begin = static_cast<std::uint32_t>(nodes_.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < boxes_.size(); i += kWidth) {
      Node& node = nodes_.emplace_back();
      node.first = first + static_cast<std::uint32_t>(i);
      node.leaf = leaf;
      Box box;
      for (std::size_t k = 0; k < kAxes; ++k) {
        node.low[k].fill(kInfinity);
        node.high[k].fill(-kInfinity);
        for (std::size_t j = i; j < std::min(i + kWidth, boxes_.size()); ++j) {
          node.low[k][j - i] = boxes_[j].min[k];
          node.high[k][j - i] = boxes_[j].max[k];
          box.min[k] = std::min(box.min[k], boxes_[j].min[k]);
          box.max[k] = std::max(box.max[k], boxes_[j].max[k]);
        }
      }
      boxes_[count++] = box;
    }
    boxes_.resize(count);
    first = begin;
  }
}

template <std::size_t kAxes>
auto Patches<kAxes>::above(const Part& part, const Point3& place) const -> std::optional<Found>
requires(kAxes == 2) {
  const double x = place[0], y = place[1];
  std::optional<Found> result;
  double best = -patches::kRounding;
  std::array<std::uint32_t, 12 * kWidth> stack;  // enough for 2^32 triangles
  std::size_t depth = 0;
  stack[depth++] = part.root;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      if (x < node.low[0][i] || y < node.low[1][i] || x > node.high[0][i] || y > node.high[1][i]) {
        continue;
      }
      if (!node.leaf) {
        stack[depth++] = node.first + i;
        continue;
      }
      const Triangle& triangle = triangles_[node.first + i];
      const auto& [a, b, c] = triangle.corners;
      const double area = patches::doubled_area(a, b, c[0], c[1]);
      if (!(area > 0.0)) continue;
      const double u = patches::doubled_area(b, c, x, y) / area;
      const double v = patches::doubled_area(c, a, x, y) / area;
      const double w = patches::doubled_area(a, b, x, y) / area;
      const double least = std::min({u, v, w});
      if (!(least >= best) || (result && least == best)) continue;
      best = least;
      // At a corner the result is exactly the corner's own height.
      const double height = u == 1.0   ? a[2]
                            : v == 1.0 ? b[2]
                            : w == 1.0 ? c[2]
                                       : u * a[2] + v * b[2] + w * c[2];
      result = Found{{x, y, height}, triangle.number};
      if (least > 0.0) return result;  // inside. No other triangle contains it
    }
  }
  return result;
}

template <std::size_t kAxes>
auto Patches<kAxes>::nearest(Part& part, const Point3& place) const -> Found requires(kAxes == 3) {
  Found found{};
  double best = kInfinity;
  const auto examine = [&](std::uint32_t triangle) {
    const auto& [a, b, c] = triangles_[triangle].corners;
    const Point3 candidate = patches::nearest_on_triangle(a, b, c, place);
    const double distance = patches::squared_distance(candidate, place);
    if (distance > best || (distance == best && !(candidate < found.place))) return;
    best = distance;
    found = {candidate, triangles_[triangle].number};
    part.last_triangle = triangle;
  };
  examine(part.last_triangle);
  struct Visit {
    double squared_distance;
    std::uint32_t child;
    bool leaf;
  };
  std::array<Visit, 12 * kWidth> stack;  // enough for 2^32 triangles
  std::size_t depth = 0;
  stack[depth++] = {0.0, part.root, false};
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (visit.squared_distance > best) continue;
    if (visit.leaf) {
      examine(visit.child);
      continue;
    }
    const Node& node = nodes_[visit.child];
    std::array<double, kWidth> squared_distances{};
    for (std::size_t k = 0; k < kAxes; ++k) {
      for (std::size_t i = 0; i < kWidth; ++i) {
        const double d = place[k] - std::min(std::max(place[k], node.low[k][i]), node.high[k][i]);
        squared_distances[i] += d * d;
      }
    }
    // Examines the nearest one first.
    const std::size_t begin = depth;
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      if (squared_distances[i] > best) continue;
      std::size_t at = depth++;
      for (; at > begin && stack[at - 1].squared_distance < squared_distances[i]; --at)
        stack[at] = stack[at - 1];
      stack[at] = {squared_distances[i], node.first + i, node.leaf};
    }
  }
  return found;
}

template class Patches<2>;
template class Patches<3>;

}  // namespace terrace::tri
