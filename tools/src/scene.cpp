// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::tools {
namespace {

stream::Point3 difference(const stream::Point3& a, const stream::Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// Twice the area along the normal of the triangle.
stream::Point3 area_vector(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const stream::Point3 u = difference(mesh.positions[t[1]], mesh.positions[t[0]]);
  const stream::Point3 v = difference(mesh.positions[t[2]], mesh.positions[t[0]]);
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

}  // namespace

bool is_height_field(const TriangleMesh& mesh) {
  double up = 0, down = 0;
  for (const auto& t : mesh.triangles) {
    const double z = area_vector(mesh, t)[2];
    (z > 0 ? up : down) += std::abs(z);
  }
  return std::max(up, down) > 0 && std::min(up, down) < 0.001 * std::max(up, down);
}

bool mostly_steep(const TriangleMesh& mesh) {
  double steep = 0, all = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 n = area_vector(mesh, t);
    const double area = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    all += area;
    if (std::abs(n[2]) < 0.5 * area) steep += area;
  }
  return steep > 0.5 * all;
}

std::vector<std::array<float, 3>> vertex_normals(const TriangleMesh& mesh) {
  std::vector<stream::Point3> sums(mesh.positions.size(), stream::Point3{});
  double up = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 n = area_vector(mesh, t);
    up += n[2];
    for (const std::uint32_t v : t) {
      for (std::size_t axis = 0; axis < 3; ++axis) sums[v][axis] += n[axis];
    }
  }
  const double sign = up < 0 && is_height_field(mesh) ? -1 : 1;
  std::vector<std::array<float, 3>> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    const double length =
        std::sqrt(sums[v][0] * sums[v][0] + sums[v][1] * sums[v][1] + sums[v][2] * sums[v][2]);
    if (length > 0) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        normals[v][axis] = static_cast<float>(sign * sums[v][axis] / length);
      }
    } else {
      normals[v] = {0, 0, 1};
    }
  }
  return normals;
}

}  // namespace terrace::tools
