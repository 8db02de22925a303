// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/portable_math.hpp>

#include "incidence.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

using shape::Vector3;

/// The angle of a face at its corner `v`, in degrees.
double angle_at(const std::array<std::uint32_t, 3>& face, std::uint32_t v,
                const std::vector<Vector3>& places) {
  const std::size_t i = face[0] == v ? 0 : face[1] == v ? 1 : 2;
  const Vector3 a = shape::minus(places[face[(i + 1) % 3]], places[v]);
  const Vector3 b = shape::minus(places[face[(i + 2) % 3]], places[v]);
  return base::atan2_degrees(shape::length(shape::cross(a, b)), shape::dot(a, b));
}

}  // namespace

std::vector<Point3> vertex_normals(const Surface& surface, unsigned threads) {
  shape::check_corners(surface);
  const shape::SurfaceFrame frame(surface.points);
  const shape::Incidence incidence(surface);
  const std::size_t count = surface.points.size();
  std::vector<Vector3> places(count);
  base::parallel_blocks(count, shape::kSurfaceBlock, threads, [&](std::size_t v, std::size_t end) {
    for (; v < end; ++v) places[v] = frame.local(surface.points[v]);
  });
  std::vector<Point3> normals(count);
  base::parallel_blocks(count, shape::kSurfaceBlock, threads, [&](std::size_t v, std::size_t end) {
    for (; v < end; ++v) {
      Vector3 sum{};
      for (const std::uint32_t f : incidence.faces_at(v)) {
        const auto& face = surface.faces[f];
        const Vector3 normal =
            shape::face_normal(places[face[0]], places[face[1]], places[face[2]]).unit;
        const double angle = angle_at(face, static_cast<std::uint32_t>(v), places);
        for (std::size_t k = 0; k < 3; ++k) sum[k] += angle * normal[k];
      }
      // Opposite normals leave rounding errors, which have no direction.
      const double length = shape::length(sum);
      if (!(length > 1e-9)) continue;
      for (std::size_t k = 0; k < 3; ++k) normals[v][k] = sum[k] / length;
    }
  });
  return normals;
}

}  // namespace terrace::tri
