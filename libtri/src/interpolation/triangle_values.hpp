// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "terrace/tri/interpolation.hpp"
#include "voronoi_cell.hpp"

/// Values that depend on triangles alone, in doubles or exact rationals.

namespace terrace::tri::planar {

/// Twice the areas of the triangles of p and two corners, as shares of their sum, if they are
/// accurate. `corner` is counter-clockwise.
template <class Number>
bool barycentric(const Query& p, const std::array<Query, 3>& corner,
                 std::array<double, 3>& weights) {
  std::array<std::array<Number, 2>, 3> at;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 2; ++k) at[i][k] = Number(corner[i][k]) - Number(p[k]);
  std::array<Number, 3> area;
  Number size = 0;
  Number total = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& b = at[(i + 1) % 3];
    const auto& c = at[(i + 2) % 3];
    const Number left = b[0] * c[1];
    const Number right = b[1] * c[0];
    area[i] = left - right;
    total += area[i];
    if constexpr (std::is_same_v<Number, double>) size += std::abs(left) + std::abs(right);
  }
  if constexpr (std::is_same_v<Number, double>) {
    const bool accurate = size * (4 * 0x1p-53 / kTolerance) < total;
    if (!accurate || !(total > kLeastSquare) || !(size < kGreatestSquare)) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) weights[i] = Rounded<Number>::of(Number(area[i] / total));
  return true;
}

/// Twice the area of a triangle, and that area times its gradient.
template <class Number>
struct Tilt {
  Number x = 0;
  Number y = 0;
  Number area = 0;
  Number size = 0;  ///< for doubles: the sum of absolute values of the products in `area`

  void add(const std::array<Query, 3>& corner, const std::array<double, 3>& height) {
    const Number bx = Number(corner[1][0]) - Number(corner[0][0]);
    const Number by = Number(corner[1][1]) - Number(corner[0][1]);
    const Number cx = Number(corner[2][0]) - Number(corner[0][0]);
    const Number cy = Number(corner[2][1]) - Number(corner[0][1]);
    const Number bh = Number(height[1]) - Number(height[0]);
    const Number ch = Number(height[2]) - Number(height[0]);
    x += bh * cy - ch * by;
    y += ch * bx - bh * cx;
    area += bx * cy - by * cx;
    if constexpr (std::is_same_v<Number, double>) size += std::abs(bx * cy) + std::abs(by * cx);
  }
  [[nodiscard]] Gradient gradient() const {
    return {Rounded<Number>::of(Number(x / area)), Rounded<Number>::of(Number(y / area))};
  }
};

}  // namespace terrace::tri::planar
