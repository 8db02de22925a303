// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/state.hpp"

namespace terrace::cluster {

/// Returns the squared distance, lane by lane.
template <class V>
V squared(V x, V y, V z, V cx, V cy, V cz) {
  const V dx = x - cx;
  const V dy = y - cy;
  const V dz = z - cz;
  return dx * dx + dy * dy + dz * dz;
}

/// Returns the square root of one float, computed by the instruction that vectors use.
template <class V>
float root(float value) {
  return largest(sqrt(V::broadcast(value)));
}

/// Computes groups of the curve and assigns all points to their nearest facilities.
template <class V>
class Assigner {
 public:
  explicit Assigner(BlockState& state) : s_(state) {}

  /// Computes the ball around each group: the centre of its box and the distance of its farthest
  /// point.
  void measure_groups() {
    s_.group_count = round_to_lanes(s_.count) / kLanes;
    for (std::uint32_t g = 0; g < s_.group_count; ++g) {
      const V x = V::load(s_.x + g * kLanes);
      const V y = V::load(s_.y + g * kLanes);
      const V z = V::load(s_.z + g * kLanes);
      s_.group_x[g] = 0.5f * (least(x) + largest(x));
      s_.group_y[g] = 0.5f * (least(y) + largest(y));
      s_.group_z[g] = 0.5f * (least(z) + largest(z));
      s_.group_radius[g] =
          root<V>(largest(squared(x, y, z, V::broadcast(s_.group_x[g]), V::broadcast(s_.group_y[g]),
                                  V::broadcast(s_.group_z[g]))));
    }
  }

  /// Finds the nearest facility of every point. Ties go to the lowest number.
  void assign() {
    const std::uint32_t end = round_to_lanes(s_.facility_count);
    const V step = V::broadcast(1.0e-6f);
    for (std::uint32_t g = 0; g < s_.group_count; ++g) {
      s_.tick(2 * end / kLanes);
      const V cx = V::broadcast(s_.group_x[g]);
      const V cy = V::broadcast(s_.group_y[g]);
      const V cz = V::broadcast(s_.group_z[g]);
      V low = V::broadcast(3.0e38f);
      for (std::uint32_t j = 0; j < end; j += kLanes) {
        const V d = squared(V::load(s_.fx + j), V::load(s_.fy + j), V::load(s_.fz + j), cx, cy, cz);
        d.store(s_.scratch + j);
        low = min(low, d);
      }
      // Every point of the group has its nearest facility within this distance of the group's
      // centre.
      const float bound = root<V>(least(low)) + 2 * s_.group_radius[g];
      const V limit = V::broadcast(bound * bound * 1.00001f) + step * step;
      const std::uint32_t i = g * kLanes;
      const V x = V::load(s_.x + i);
      const V y = V::load(s_.y + i);
      const V z = V::load(s_.z + i);
      V best = V::broadcast(3.0e38f);
      V number = V::broadcast(0);
      for (std::uint32_t j = 0; j < end; j += kLanes) {
        std::uint32_t bits = less(V::load(s_.scratch + j), limit).bits();
        while (bits != 0) {
          const std::uint32_t k = j + static_cast<std::uint32_t>(__builtin_ctz(bits));
          bits &= bits - 1;
          const V d = squared(x, y, z, V::broadcast(s_.fx[k]), V::broadcast(s_.fy[k]),
                              V::broadcast(s_.fz[k]));
          const typename V::Mask nearer = less(d, best);
          best = min(d, best);
          number = select(nearer, V::broadcast(static_cast<float>(k)), number);
        }
      }
      sqrt(best).store(s_.distance + i);
      number.store_as_integers(s_.nearest + i);
    }
  }

 private:
  BlockState& s_;
};

}  // namespace terrace::cluster
