// SPDX-License-Identifier: Apache-2.0
#include "scaling.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::cluster {

Scaling::Scaling(std::span<const Point3> points) {
  if (points.empty()) return;
  Point3 low = points.front();
  Point3 high = low;
  for (const Point3& p : points) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  corner = low;
  // Halves are used, because the difference of two finite numbers may be infinite.
  Point3 half{};
  double longest = 0.0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    half[axis] = high[axis] * 0.5 - low[axis] * 0.5;
    longest = std::max(longest, half[axis]);
  }
  // Halving may have rounded denormal sides to zero.
  if (longest < 0x1p-1000) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      half[axis] = high[axis] - low[axis];
      longest = std::max(longest, half[axis]);
    }
    if (longest == 0.0) return;
    std::frexp(longest, &exponent);
  } else {
    std::frexp(longest, &exponent);
    ++exponent;
  }
  plain = exponent > -1000 && exponent < 1000;
  factor = plain ? std::ldexp(1.0, -exponent) : 1.0;
  extent = scaled(high);
  diagonal = std::sqrt(extent[0] * extent[0] + extent[1] * extent[1] + extent[2] * extent[2]);
}

double Scaling::scaled_slowly(double value, unsigned axis) const {
  if (exponent < 0) return std::ldexp(value - corner[axis], -exponent);
  return std::ldexp(value * 0.5 - corner[axis] * 0.5, 1 - exponent);
}

double Scaling::unscaled(double length) const { return std::ldexp(length, exponent); }

}  // namespace terrace::cluster
