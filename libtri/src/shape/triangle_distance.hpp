// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "gabriel.hpp"

namespace terrace::tri::shape {

/// Squared distances of points from a triangle, which may be degenerate.
class TriangleDistance {
 public:
  TriangleDistance(const Vector3& a, const Vector3& b, const Vector3& c) : corners_{a, b, c} {
    const Vector3 normal = cross(minus(b, a), minus(c, a));
    normal_ = normal;
    normal_square_ = dot(normal, normal);
    for (std::size_t k = 0; k < 3; ++k) {
      edges_[k] = minus(corners_[(k + 1) % 3], corners_[k]);
      squares_[k] = dot(edges_[k], edges_[k]);
      inward_[k] = cross(normal, edges_[k]);
    }
  }

  [[nodiscard]] double square(const Vector3& point) const {
    std::array<Vector3, 3> from{};
    bool above = normal_square_ > 0.0;  // the triangle
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = minus(point, corners_[k]);
      above = above && dot(inward_[k], from[k]) >= 0.0;
    }
    if (above) {
      const double height = dot(normal_, from[0]);
      return height * (height / normal_square_);
    }
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      const double along =
          squares_[k] > 0.0 ? std::clamp(dot(from[k], edges_[k]) / squares_[k], 0.0, 1.0) : 0.0;
      const Vector3 across{from[k][0] - along * edges_[k][0], from[k][1] - along * edges_[k][1],
                           from[k][2] - along * edges_[k][2]};
      least = std::min(least, dot(across, across));
    }
    return least;
  }

 private:
  std::array<Vector3, 3> corners_, edges_{}, inward_{};  ///< inward_: normals of edges in the plane
  std::array<double, 3> squares_{};                      ///< of the lengths of edges
  Vector3 normal_{};
  double normal_square_ = 0.0;
};

}  // namespace terrace::tri::shape
