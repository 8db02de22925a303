// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/engine_assign.hpp"

namespace terrace::cluster {

/// Updates single facilities: the data about their clients, and their positions.
template <class V>
class Facilities {
 public:
  explicit Facilities(BlockState& state) : s_(state) {}

  /// Computes the data that pruning needs about facility j, from its segment.
  void summarise(std::uint32_t j) {
    V weight_sum = V::broadcast(0);
    V cost_sum = weight_sum;
    V longest = weight_sum;
    V sx = weight_sum;
    V sy = weight_sum;
    V sz = weight_sum;
    const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
    for (std::uint32_t i = s_.begin[j]; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = V::load(s_.pd + i);
      weight_sum = weight_sum + w;
      cost_sum = cost_sum + w * d;
      longest = max(longest, d);
      sx = sx + w * V::load(s_.px + i);
      sy = sy + w * V::load(s_.py + i);
      sz = sz + w * V::load(s_.pz + i);
    }
    set_summary(j, sum(weight_sum), sum(cost_sum), largest(longest), sum(sx), sum(sy), sum(sz));
  }

  void set_summary(std::uint32_t j, float weight_sum, float cost_sum, float longest, float sx,
                   float sy, float sz) {
    s_.weight_sum[j] = weight_sum;
    s_.connection_cost[j] = cost_sum;
    s_.longest[j] = longest;
    const float inverse = weight_sum > 0 ? 1.0f / weight_sum : 0.0f;
    s_.mean_x[j] = sx * inverse;
    s_.mean_y[j] = sy * inverse;
    s_.mean_z[j] = sz * inverse;
    // Let D be the distance of a candidate. If D is at least twice the longest connection, no
    // client is nearer to the candidate. By the triangle inequality, closing this facility loses at
    // least weight_sum * D - 2 * cost_sum, and it pays off only below the facility cost.
    const float closing_range = (s_.facility_cost + 2 * cost_sum) * inverse;
    const float range = 2 * longest > closing_range ? 2 * longest : closing_range;
    s_.gain_range[j] = weight_sum > 0 ? range * range * 1.00001f : kFarAway * kFarAway;
  }

  /// Moves facility j to the client nearest to the median of its clients, if that is cheaper.
  void recentre(std::uint32_t j) {
    const std::uint32_t first = s_.begin[j];
    const std::uint32_t end = first + round_to_lanes(s_.size[j]);
    float cx = s_.mean_x[j];
    float cy = s_.mean_y[j];
    float cz = s_.mean_z[j];
    // Makes one step of Weiszfeld's iteration from the mean.
    {
      V sw = V::broadcast(0);
      V sx = sw;
      V sy = sw;
      V sz = sw;
      const V tiny = V::broadcast(1e-6f + 0.05f * s_.longest[j]);
      for (std::uint32_t i = first; i < end; i += kLanes) {
        const V x = V::load(s_.px + i);
        const V y = V::load(s_.py + i);
        const V z = V::load(s_.pz + i);
        const V d = sqrt(squared(x, y, z, V::broadcast(cx), V::broadcast(cy), V::broadcast(cz)));
        const V w = V::load(s_.pw + i) / max(d, tiny);
        sw = sw + w;
        sx = sx + w * x;
        sy = sy + w * y;
        sz = sz + w * z;
      }
      const float weight = sum(sw);
      if (!(weight > 0)) return;
      cx = sum(sx) / weight;
      cy = sum(sy) / weight;
      cz = sum(sz) / weight;
    }
    V best = V::broadcast(3.0e38f);
    V best_lane = V::broadcast(0);
    V index = V::iota();
    const V lanes = V::broadcast(static_cast<float>(kLanes));
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V d = squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                          V::broadcast(cx), V::broadcast(cy), V::broadcast(cz));
      const Mask nearer = less(d, best);
      best = select(nearer, d, best);
      best_lane = select(nearer, index, best_lane);
      index = index + lanes;
    }
    const float closest = least(best);
    // Surplus lanes are at the facility's position. If one wins, nothing changes.
    const Mask worse = less(V::broadcast(closest), best);
    const float best_offset = least(select(worse, V::broadcast(3.0e38f), best_lane));
    if (!(best_offset < static_cast<float>(s_.size[j]))) return;
    const std::uint32_t medoid = first + static_cast<std::uint32_t>(best_offset);
    const float x = s_.px[medoid];
    const float y = s_.py[medoid];
    const float z = s_.pz[medoid];
    V cost_sum = V::broadcast(0);
    V longest = cost_sum;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                               V::broadcast(x), V::broadcast(y), V::broadcast(z)));
      const V counted = select(less(V::broadcast(0), w), d, V::broadcast(0));
      counted.store(s_.scratch_pool + i - first);
      cost_sum = cost_sum + w * d;
      longest = max(longest, counted);
    }
    const float cost = sum(cost_sum);
    if (!(cost < s_.connection_cost[j])) return;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      V::load(s_.scratch_pool + i - first).store(s_.pd + i);
    }
    s_.facility[j] = static_cast<std::uint32_t>(s_.pp[medoid]);
    s_.fx[j] = x;
    s_.fy[j] = y;
    s_.fz[j] = z;
    const float weight_sum = s_.weight_sum[j];
    set_summary(j, weight_sum, cost, largest(longest), s_.mean_x[j] * weight_sum,
                s_.mean_y[j] * weight_sum, s_.mean_z[j] * weight_sum);
  }

 private:
  using Mask = typename V::Mask;

  BlockState& s_;
};

}  // namespace terrace::cluster
