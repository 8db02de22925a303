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
    V load = V::broadcast(0);
    V spent = load;
    V far = load;
    V sx = load;
    V sy = load;
    V sz = load;
    const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
    for (std::uint32_t i = s_.begin[j]; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = V::load(s_.pd + i);
      load = load + w;
      spent = spent + w * d;
      far = max(far, d);
      sx = sx + w * V::load(s_.px + i);
      sy = sy + w * V::load(s_.py + i);
      sz = sz + w * V::load(s_.pz + i);
    }
    set_summary(j, sum(load), sum(spent), largest(far), sum(sx), sum(sy), sum(sz));
  }

  void set_summary(std::uint32_t j, float load, float spent, float furthest, float sx, float sy,
                   float sz) {
    s_.load[j] = load;
    s_.spent[j] = spent;
    s_.furthest[j] = furthest;
    const float inverse = load > 0 ? 1.0f / load : 0.0f;
    s_.mean_x[j] = sx * inverse;
    s_.mean_y[j] = sy * inverse;
    s_.mean_z[j] = sz * inverse;
    // No client beyond twice the longest connection is nearer to the candidate. Closing loses at
    // least load
    // * D - 2 * spent (triangle inequality), which must stay below the facility cost.
    const float closing = (s_.facility_cost + 2 * spent) * inverse;
    const float far = 2 * furthest > closing ? 2 * furthest : closing;
    s_.reach[j] = load > 0 ? far * far * 1.00001f : kFarAway * kFarAway;
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
      const V tiny = V::broadcast(1e-6f + 0.05f * s_.furthest[j]);
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
    V place = V::broadcast(0);
    V here = V::iota();
    const V lanes = V::broadcast(static_cast<float>(kLanes));
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V d = squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                          V::broadcast(cx), V::broadcast(cy), V::broadcast(cz));
      const Mask nearer = less(d, best);
      best = select(nearer, d, best);
      place = select(nearer, here, place);
      here = here + lanes;
    }
    const float closest = least(best);
    // Surplus lanes are at the facility's position. If one wins, nothing changes.
    const Mask others = less(V::broadcast(closest), best);
    const float where = least(select(others, V::broadcast(3.0e38f), place));
    if (!(where < static_cast<float>(s_.size[j]))) return;
    const std::uint32_t chosen = first + static_cast<std::uint32_t>(where);
    const float x = s_.px[chosen];
    const float y = s_.py[chosen];
    const float z = s_.pz[chosen];
    V spent = V::broadcast(0);
    V far = spent;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                               V::broadcast(x), V::broadcast(y), V::broadcast(z)));
      const V counted = select(less(V::broadcast(0), w), d, V::broadcast(0));
      counted.store(s_.scratch_pool + i - first);
      spent = spent + w * d;
      far = max(far, counted);
    }
    const float cost = sum(spent);
    if (!(cost < s_.spent[j])) return;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      V::load(s_.scratch_pool + i - first).store(s_.pd + i);
    }
    s_.facility[j] = static_cast<std::uint32_t>(s_.pp[chosen]);
    s_.fx[j] = x;
    s_.fy[j] = y;
    s_.fz[j] = z;
    const float load = s_.load[j];
    set_summary(j, load, cost, largest(far), s_.mean_x[j] * load, s_.mean_y[j] * load,
                s_.mean_z[j] * load);
  }

 private:
  using Mask = typename V::Mask;

  BlockState& s_;
};

}  // namespace terrace::cluster
