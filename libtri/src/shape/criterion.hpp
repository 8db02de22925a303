// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "../delaunay3/elliptical_kernel.hpp"
#include "../delaunay3/mesh.hpp"
#include "gabriel.hpp"

/// The two criteria for facets that are likely to be on the surface. Both depend on the points of
/// the tetrahedron alone, not on the order of its corners.

namespace terrace::tri::shape {

/// True if the mesh is in an elliptical metric, which the current scope supplies.
template <class Mesh>
inline constexpr bool is_elliptical =
    std::is_same_v<typename Mesh::Kernel, spatial::EllipticalKernel>;

/// A criterion returns true if the facet opposite to corner i of a tetrahedron is a boundary facet
/// as seen from that tetrahedron.
struct Gabriel {
  template <class Mesh>
  bool boundary(const Mesh& mesh, const spatial::Tetrahedron& t, std::uint32_t i) const {
    const auto f = spatial::facet_of(t, i);
    const auto* vertex = mesh.vertex.data();
    const auto &a = vertex[f[0]].point, &b = vertex[f[1]].point, &c = vertex[f[2]].point;
    const auto& d = vertex[t.corner[i]].point;
    if constexpr (is_elliptical<Mesh>) {
      return !in_smallest_ellipsoid(a, b, c, d);
    } else {
      return !in_smallest_sphere(a, b, c, d);
    }
  }
};

/// The distance, computed without overflow or underflow. Symmetric.
inline double distance(const Vector3& a, const Vector3& b) {
  // The difference of quarters of finite doubles is finite. Below kLargeScale, scaling is exact.
  constexpr double kLargeScale = 0x1p480, kSmallScale = 0x1p-480;
  Vector3 d = minus(a, b);
  const double m = largest(d);
  if (m > kSmallScale && m < kLargeScale) [[likely]]
    return std::sqrt(dot(d, d));
  if (m == 0.0) return 0.0;
  if (m <= kSmallScale) {
    for (double& c : d) c *= 0x1p540;
    return std::sqrt(dot(d, d)) * 0x1p-540;
  }
  for (std::size_t k = 0; k < 3; ++k) d[k] = a[k] * 0x1p-560 - b[k] * 0x1p-560;
  return std::sqrt(dot(d, d)) * 0x1p560;  // may be infinite, as the sum of such lengths would be
}

/// The vector from a to b. In an elliptical metric it is mapped to where the metric is Euclidean.
template <class Mesh>
Vector3 edge(const Mesh&, const Vector3& a, const Vector3& b) {
  if constexpr (is_elliptical<Mesh>) {
    return spatial::EllipticalKernel::by_map(b, a);
  } else {
    return minus(b, a);
  }
}

/// The length of that vector.
template <class Mesh>
double edge_length(const Mesh& mesh, const Vector3& a, const Vector3& b) {
  if constexpr (is_elliptical<Mesh>) {
    return distance(edge(mesh, a, b), {});
  } else {
    return distance(a, b);
  }
}

struct EdgeLength {
  double factor;

  template <class Mesh>
  bool boundary(const Mesh& mesh, const spatial::Tetrahedron& t, std::uint32_t i) const {
    const auto f = spatial::facet_of(t, i);
    std::array<Vector3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = to_doubles(mesh.vertex[f[k]].point);
    const Vector3 apex = to_doubles(mesh.vertex[t.corner[i]].point);
    const auto length = [&](const Vector3& a, const Vector3& b) { return edge_length(mesh, a, b); };
    return sum({length(p[0], p[1]), length(p[1], p[2]), length(p[2], p[0])}) <
           factor * sum({length(p[0], apex), length(p[1], apex), length(p[2], apex)});
  }

 private:
  /// Adds in order of size, so that the order of the corners does not affect the last bit.
  static double sum(std::array<double, 3> lengths) {
    std::sort(lengths.begin(), lengths.end());
    // both sides have the same scale and are finite
    return lengths[0] / 8 + lengths[1] / 8 + lengths[2] / 8;
  }
};

}  // namespace terrace::tri::shape
