// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

/// The triangle under the pointer, and outlines of triangles.

namespace terrace::viewer {

inline stream::Point3 difference(const stream::Point3& a, const stream::Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const stream::Point3& a, const stream::Point3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline stream::Point3 cross(const stream::Point3& a, const stream::Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct TriangleHit {
  tri::TriangleId triangle = tri::kNoTriangle;
  std::array<double, 3> weights{};  ///< of the corners
  double distance = std::numeric_limits<double>::infinity();

  /// The corner with the largest weight.
  [[nodiscard]] std::size_t nearest() const {
    return static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) -
                                    weights.begin());
  }
};

/// Returns where a ray first meets a triangle, by T. Möller, B. Trumbore, "Fast, minimum storage
/// ray-triangle intersection", doi:10.1080/10867651.1997.10487468. unit: the ray's direction.
/// position(vertex) returns a corner; skips(triangle) is true for triangles that are not drawn.
template <class Mesh, class Position, class Skips>
std::optional<TriangleHit> first_hit(const Mesh& mesh, const stream::Point3& origin,
                                     const stream::Point3& unit, const Position& position,
                                     const Skips& skips) {
  TriangleHit best;
  for (const tri::TriangleId triangle : mesh.all_triangles()) {
    const auto corners = mesh.vertices(triangle);
    const stream::Point3 a = position(corners[0]);
    const stream::Point3 ab = difference(position(corners[1]), a),
                         ac = difference(position(corners[2]), a);
    const stream::Point3 p = cross(unit, ac);
    const double determinant = dot(ab, p);
    if (determinant == 0) continue;
    const stream::Point3 from = difference(origin, a);
    const double u = dot(from, p) / determinant;
    if (!(u >= 0 && u <= 1)) continue;
    const stream::Point3 q = cross(from, ab);
    const double v = dot(unit, q) / determinant;
    if (!(v >= 0 && u + v <= 1)) continue;
    const double distance = dot(ac, q) / determinant;
    if (!(distance > 0 && distance < best.distance) || skips(triangle)) continue;
    best = {triangle, {1 - u - v, u, v}, distance};
  }
  if (best.triangle == tri::kNoTriangle) return std::nullopt;
  return best;
}

/// Returns the edges, as pairs of vertices, of which the opposite direction is not in the list: the
/// outline of triangles whose edges these are. Sorts `edges`.
inline std::vector<std::array<std::uint32_t, 2>> outline_of(
    std::vector<std::array<std::uint32_t, 2>>& edges) {
  std::vector<std::array<std::uint32_t, 2>> lines;
  std::sort(edges.begin(), edges.end());
  for (const auto& [a, b] : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), std::array<std::uint32_t, 2>{b, a})) {
      lines.push_back({a, b});
    }
  }
  return lines;
}

}  // namespace terrace::viewer
