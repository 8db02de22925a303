// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/union_find.hpp>

#include "incidence.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

struct SurfaceEdge {
  std::uint64_t ends;  ///< the smaller number in the upper half
  std::uint32_t face;
  std::int32_t direction;  ///< +1: from the smaller to the larger
};

/// Three edges per face, sorted by their ends and then by face.
std::vector<SurfaceEdge> sorted_edges(std::span<const std::array<std::uint32_t, 3>> faces) {
  std::vector<SurfaceEdge> edges;
  edges.reserve(3 * faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = faces[f][i], to = faces[f][(i + 1) % 3];
      edges.push_back(
          {std::uint64_t{std::min(from, to)} << 32 | std::max(from, to), f, from < to ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const SurfaceEdge& a, const SurfaceEdge& b) {
    return a.ends != b.ends ? a.ends < b.ends : a.face < b.face;
  });
  return edges;
}

/// The sets of faces that edges join.
base::UnionFind parts_of(std::span<const std::array<std::uint32_t, 3>> faces) {
  base::UnionFind parts(faces.size());
  const std::vector<SurfaceEdge> edges = sorted_edges(faces);
  for (std::size_t i = 1; i < edges.size(); ++i)
    if (edges[i].ends == edges[i - 1].ends) parts.unite(edges[i].face, edges[i - 1].face);
  return parts;
}

Point3 normal2(const Surface& surface, std::uint32_t face) {
  const auto& [a, b, c] = surface.faces[face];
  Point3 u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = surface.points[b][k] - surface.points[a][k];
    v[k] = surface.points[c][k] - surface.points[a][k];
  }
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// Six times the volume between a point and a face, positive if the face is turned away.
double volume6_from(const Surface& surface, const Point3& from, std::uint32_t face) {
  const Point3 normal = normal2(surface, face);
  const Point3& a = surface.points[surface.faces[face][0]];
  return (a[0] - from[0]) * normal[0] + (a[1] - from[1]) * normal[1] + (a[2] - from[2]) * normal[2];
}

void add_areas(const Surface& surface, SurfaceMeasures& result) {
  if (surface.faces.empty()) return;
  // Measured from a point of the surface: far from the origin the volumes would cancel badly.
  const Point3& from = surface.points[surface.faces[0][0]];
  double area2 = 0.0, volume6 = 0.0;
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const Point3 normal = normal2(surface, f);
    area2 += std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    volume6 += volume6_from(surface, from, f);
  }
  result.area = area2 / 2;
  result.volume = volume6 / 6;
}

}  // namespace

SurfaceMeasures measure(const Surface& surface) {
  shape::check_faces(surface);
  SurfaceMeasures result;
  result.faces = surface.faces.size();
  add_areas(surface, result);

  std::vector<bool> used(surface.points.size());
  for (const auto& face : surface.faces)
    for (const std::uint32_t v : face) used[v] = true;
  result.vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  const std::vector<SurfaceEdge> edges = sorted_edges(surface.faces);
  base::UnionFind parts(surface.faces.size());
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    std::int64_t direction_sum = 0;
    for (; end < edges.size() && edges[end].ends == edges[begin].ends; ++end) {
      direction_sum += edges[end].direction;
      parts.unite(edges[begin].face, edges[end].face);
    }
    ++result.edges;
    result.border_edges += end - begin == 1;
    result.non_manifold_edges += end - begin > 2;
    if (direction_sum != 0) result.closed = false;
  }
  result.components = parts.sets();
  result.euler_characteristic = static_cast<std::int64_t>(result.vertices) -
                                static_cast<std::int64_t>(result.edges) +
                                static_cast<std::int64_t>(result.faces);
  return result;
}

void turn_outward(Surface& surface) {
  shape::check_faces(surface);
  base::UnionFind parts = parts_of(surface.faces);
  std::vector<double> volume(surface.faces.size());
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const std::uint32_t part = parts.find(f);
    volume[part] += volume6_from(surface, surface.points[surface.faces[part][0]], f);
  }
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (volume[parts.find(f)] < 0.0) std::swap(surface.faces[f][1], surface.faces[f][2]);
}

}  // namespace terrace::tri
