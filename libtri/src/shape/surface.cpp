// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "shape/surface_parts.hpp"
#include "terrace/tri/shape.hpp"

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

void add_areas(const Surface& surface, SurfaceMeasures& result) {
  if (surface.faces.empty()) return;
  // From a point of the surface: far from the origin the volumes would cancel badly.
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
  check(surface);
  SurfaceMeasures result;
  result.faces = surface.faces.size();
  add_areas(surface, result);

  std::vector<bool> used(surface.points.size());
  for (const auto& face : surface.faces)
    for (const std::uint32_t v : face) used[v] = true;
  result.vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  const std::vector<SurfaceEdge> edges = sorted_edges(surface.faces);
  SurfaceParts parts(surface.faces.size());
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

void turn_outward(Surface& surface) {
  check(surface);
  SurfaceParts parts = parts_of(surface.faces);
  std::vector<double> volume(surface.faces.size());
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const std::uint32_t part = parts.root(f);
    volume[part] += volume6_from(surface, surface.points[surface.faces[part][0]], f);
  }
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (volume[parts.root(f)] < 0.0) std::swap(surface.faces[f][1], surface.faces[f][2]);
}

}  // namespace terrace::tri
