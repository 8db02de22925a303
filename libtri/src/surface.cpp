// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace terrace::tri {
namespace {

void check(const Surface& surface) {
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    const auto& face = surface.faces[f];
    for (std::size_t i = 0; i < 3; ++i) {
      if (face[i] >= surface.points.size())
        throw std::invalid_argument("face " + std::to_string(f) + ": corner " +
                                    std::to_string(face[i]) + ", but there are only " +
                                    std::to_string(surface.points.size()) + " points");
      if (face[i] == face[(i + 1) % 3])
        throw std::invalid_argument("face " + std::to_string(f) + ": corner " +
                                    std::to_string(face[i]) +
                                    " is there twice; leave such faces out");
    }
  }
}

struct Edge {
  std::uint64_t ends;  ///< the smaller number in the upper half
  std::uint32_t face;
  std::int32_t way;  ///< +1 or -1
};

class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count), count_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    --count_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::uint32_t root(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  std::vector<std::uint32_t> parent_;
  std::size_t count_;
};

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void add_areas(const Surface& surface, SurfaceMeasures& result) {
  if (surface.faces.empty()) return;
  // From a point of the surface: far from the origin the volumes would cancel badly.
  const Vector& from = surface.points[surface.faces[0][0]];
  double area2 = 0.0, volume6 = 0.0;
  for (const auto& face : surface.faces) {
    const Vector& a = surface.points[face[0]];
    const Vector normal =
        cross(minus(surface.points[face[1]], a), minus(surface.points[face[2]], a));
    area2 += std::sqrt(dot(normal, normal));
    volume6 += dot(minus(a, from), normal);
  }
  result.area = area2 / 2;
  result.volume = volume6 / 6;
}

}  // namespace

SurfaceMeasures measure(const Surface& surface) {
  check(surface);
  SurfaceMeasures result;
  result.faces = surface.faces.size();
  add_areas(surface, result);

  std::vector<bool> used(surface.points.size());
  std::vector<Edge> edges;
  edges.reserve(3 * surface.faces.size());
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = surface.faces[f][i], to = surface.faces[f][(i + 1) % 3];
      used[from] = true;
      edges.push_back(
          {std::uint64_t{std::min(from, to)} << 32 | std::max(from, to), f, from < to ? 1 : -1});
    }
  }
  result.vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.ends < b.ends; });
  Parts parts(surface.faces.size());
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    std::int64_t ways = 0;
    for (; end < edges.size() && edges[end].ends == edges[begin].ends; ++end) {
      ways += edges[end].way;
      parts.join(edges[begin].face, edges[end].face);
    }
    ++result.edges;
    result.border_edges += end - begin == 1;
    result.non_manifold_edges += end - begin > 2;
    if (ways != 0) result.closed = false;
  }
  result.components = parts.count();
  result.euler_characteristic = static_cast<std::int64_t>(result.vertices) -
                                static_cast<std::int64_t>(result.edges) +
                                static_cast<std::int64_t>(result.faces);
  return result;
}

}  // namespace terrace::tri
