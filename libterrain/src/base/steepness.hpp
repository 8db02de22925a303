// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "base/vector.hpp"

namespace terrace::terrain {

/// Measures how much of a surface is steeper than 60 degrees. If more than half of it is, the
/// triangles join the upper and the lower side of a body that was triangulated as if it were
/// terrain.
class Steepness {
 public:
  /// `normal`: normal of a triangle with the length of its area; all may be scaled by one factor.
  void add(const std::array<double, 3>& normal) {
    const double area = std::sqrt(dot(normal, normal));
    all_ += area;
    if (std::abs(normal[2]) < 0.5 * area) steep_ += area;
  }
  [[nodiscard]] bool mostly() const { return steep_ > 0.5 * all_; }

 private:
  double steep_ = 0, all_ = 0;
};

}  // namespace terrace::terrain
