// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include <terrace/stream/schema.hpp>

namespace terrace::terrain {

/// Returns the box in stored coordinates around a box in the CRS. Heights stay unbounded where
/// `world` is.
inline stream::Box3 stored_box(const stream::Placement& placement, const stream::Box3& world) {
  stream::Box3 stored;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const auto place = stored_place(placement, {(corner & 1 ? world.max : world.min)[0],
                                                (corner & 2 ? world.max : world.min)[1]});
    stored.include(stream::Point3{place[0], place[1], 0});
  }
  const stream::Channel& z = placement.coordinates[2];
  double low = (world.min[2] - z.offset) / z.scale, high = (world.max[2] - z.offset) / z.scale;
  if (low > high) std::swap(low, high);
  // The division rounds, so move the box outward by one part in 2^40. Detail::wants() decides.
  const auto outward = [](double value, double sign) {
    return value + sign * (std::abs(value) * 0x1p-40 + 0x1p-40);
  };
  return {{outward(stored.min[0], -1), outward(stored.min[1], -1), outward(low, -1)},
          {outward(stored.max[0], 1), outward(stored.max[1], 1), outward(high, 1)}};
}

}  // namespace terrace::terrain
