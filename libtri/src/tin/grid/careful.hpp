// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "rows.hpp"
#include "scan.hpp"
#include "tin/ground.hpp"

namespace terrace::tri::tin {

struct CarefulWorst {
  double error = 0;
  double slack = 0;  ///< what rounding may have done to it
  std::uint32_t place = 0;
  bool missing = false;  ///< a sample has no data
};

/// What the scans do, in double, for triangles whose planes are too steep for floats. Corners do
/// not count.
template <class T>
CarefulWorst careful_worst(const GridSamples<T>& samples, const GridCorner<T>& a,
                           const GridCorner<T>& b, const GridCorner<T>& c) {
  CarefulWorst worst;
  const auto base = static_cast<double>(a.z);
  const double bz = static_cast<double>(b.z) - base, cz = static_cast<double>(c.z) - base;
  const double bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y;
  const auto area = static_cast<double>(turn(a, b, c));
  const double slope_x = (bz * cy - cz * by) / area, slope_y = (cz * bx - bz * cx) / area;
  const double width = std::max({std::fabs(bx), std::fabs(cx), std::fabs(bx - cx)});
  const double height = std::max({std::fabs(by), std::fabs(cy), std::fabs(by - cy)});
  worst.slack = 0x1p-50 * (std::fabs(slope_x) * width + std::fabs(slope_y) * height +
                           (std::fabs(bz) + std::fabs(cz)) * (1 + 2 * width * height / area));
  const auto is = [](const GridCorner<T>& corner, std::int32_t x, std::int32_t y) {
    return corner.x == x && corner.y == y;
  };
  visit_rows(a, b, c, [&](std::int32_t y, std::int32_t first, std::int32_t last) {
    if (y < samples.first_y || y > samples.last_y) return true;
    const T* const row = samples.heights + static_cast<std::size_t>(y) * samples.stride;
    for (std::int32_t x = std::max(first, samples.first_x); x <= std::min(last, samples.last_x);
         ++x) {
      const double rise = slope_x * (x - a.x) + slope_y * (y - a.y);
      const double error = std::fabs(static_cast<double>(row[x]) - base - rise);
      worst.missing |= !(error >= 0);
      if (!(error > worst.error) || is(a, x, y) || is(b, x, y) || is(c, x, y)) continue;
      worst.error = error;
      worst.place = static_cast<std::uint32_t>(y) << 16 | static_cast<std::uint32_t>(x);
    }
    return !worst.missing;
  });
  return worst;
}

}  // namespace terrace::tri::tin
