// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/engine_facilities.hpp"
#include "block/engine_segments.hpp"

namespace terrace::cluster {

/// One step of the local search: evaluate() computes the gain of a candidate, open() opens it. See
/// BlockState for the layout.
template <class V>
class CandidateStep {
 public:
  explicit CandidateStep(BlockState& state) : s_(state), facilities_(state) {}

  /// Returns the saving from opening a facility at (x, y, z). Sets nearby, nearby_count and
  /// close_flag for open().
  float evaluate(float x, float y, float z) {
    const V cx = V::broadcast(x);
    const V cy = V::broadcast(y);
    const V cz = V::broadcast(z);
    const V zero = V::broadcast(0);
    const std::uint32_t facilities = round_to_lanes(s_.facility_count);
    std::uint32_t count = 0;
    for (std::uint32_t j = 0; j < facilities; j += kLanes) {
      const V d = squared(V::load(s_.fx + j), V::load(s_.fy + j), V::load(s_.fz + j), cx, cy, cz);
      std::uint32_t bits = less(d, V::load(s_.gain_range + j)).bits();
      while (bits != 0) {
        s_.nearby[count++] = j + static_cast<std::uint32_t>(__builtin_ctz(bits));
        bits &= bits - 1;
      }
    }
    s_.nearby_count = count;
    float total = -s_.facility_cost;
    V savings = zero;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t j = s_.nearby[k];
      const std::uint32_t first = s_.begin[j];
      const std::uint32_t end = first + round_to_lanes(s_.size[j]);
      // Distance is convex, so closing j loses at least
      // weight_sum * |candidate - mean| - connection_cost. Skip the sum of losses if this bound
      // already exceeds the facility cost.
      const float to_mean_x = s_.mean_x[j] - x;
      const float to_mean_y = s_.mean_y[j] - y;
      const float to_mean_z = s_.mean_z[j] - z;
      const float loss_limit = s_.facility_cost + s_.connection_cost[j];
      const float weight = s_.weight_sum[j];
      s_.close_flag[k] = 0;
      if (weight * weight *
              (to_mean_x * to_mean_x + to_mean_y * to_mean_y + to_mean_z * to_mean_z) <
          loss_limit * loss_limit) {
        V losses = zero;
        for (std::uint32_t i = first; i < end; i += kLanes) {
          const V d =
              sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i), cx, cy, cz));
          const V change = (V::load(s_.pd + i) - d) * V::load(s_.pw + i);
          const V better = max(change, zero);
          savings = savings + better;
          losses = losses + (better - change);
        }
        const float loss = sum(losses);
        if (loss < s_.facility_cost) {
          s_.close_flag[k] = 1;
          total += s_.facility_cost - loss;
        }
      } else {
        for (std::uint32_t i = first; i < end; i += kLanes) {
          const V d =
              sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i), cx, cy, cz));
          const V change = (V::load(s_.pd + i) - d) * V::load(s_.pw + i);
          savings = savings + max(change, zero);
        }
      }
    }
    return total + sum(savings);
  }

  /// Opens a facility at the point. Requires a preceding evaluate() at this point's position.
  void open(std::uint32_t point) {
    std::uint32_t capacity = kLanes;
    for (std::uint32_t k = 0; k < s_.nearby_count; ++k)
      capacity += round_to_lanes(s_.size[s_.nearby[k]]);
    s_.reserve_pool(capacity);
    const std::uint32_t first = s_.pool_used;
    std::uint32_t move_end = first;
    const V cx = V::broadcast(s_.x[point]);
    const V cy = V::broadcast(s_.y[point]);
    const V cz = V::broadcast(s_.z[point]);
    const V zero = V::broadcast(0);
    for (std::uint32_t k = 0; k < s_.nearby_count; ++k) {
      const std::uint32_t j = s_.nearby[k];
      const bool close = s_.close_flag[k] != 0;
      const std::uint32_t begin = s_.begin[j];
      const std::uint32_t end = begin + round_to_lanes(s_.size[j]);
      std::uint32_t stay_end = begin;
      bool changed = false;
      for (std::uint32_t i = begin; i < end; i += kLanes) {
        const V x = V::load(s_.px + i);
        const V y = V::load(s_.py + i);
        const V z = V::load(s_.pz + i);
        const V d = sqrt(squared(x, y, z, cx, cy, cz));
        const V old = V::load(s_.pd + i);
        const V w = V::load(s_.pw + i);
        const Mask client = less(zero, w);
        // The last lanes of a vector may be surplus. They have no weight, so they do not move.
        const Mask move_mask = close ? client : client & less(d, old);
        const std::uint32_t bits = move_mask.bits();
        if (bits == 0 && !changed) {
          stay_end = i + kLanes;
          continue;
        }
        const V p = V::load(s_.pp + i);
        if (bits != 0) {
          compress_points(s_, move_end, move_mask, x, y, z, w, d, p);
          move_end += static_cast<std::uint32_t>(__builtin_popcount(bits));
        }
        if (!close) {
          const Mask stay_mask = client & ~move_mask;
          compress_points(s_, stay_end, stay_mask, x, y, z, w, old, p);
          stay_end += static_cast<std::uint32_t>(__builtin_popcount(stay_mask.bits()));
          changed = true;
        }
      }
      if (changed) {
        s_.size[j] = stay_end - begin;
        clear_surplus(stay_end);
        facilities_.summarise(j);
      }
    }
    for (std::uint32_t k = s_.nearby_count; k-- > 0;) {
      if (s_.close_flag[k] != 0) s_.remove_facility(s_.nearby[k]);
    }
    const std::uint32_t j = s_.add_facility(point);
    s_.begin[j] = first;
    s_.size[j] = move_end - first;
    clear_surplus(move_end);
    s_.pool_used = first + round_to_lanes(move_end - first);
    facilities_.summarise(j);
    facilities_.recentre(j);
  }

  /// Zeroes the lanes from `end` to the next multiple of kLanes, so that they do not count.
  void clear_surplus(std::uint32_t end) {
    for (std::uint32_t i = end; i < round_to_lanes(end); ++i) {
      s_.px[i] = s_.py[i] = s_.pz[i] = s_.pw[i] = s_.pd[i] = 0;
    }
  }

 private:
  using Mask = typename V::Mask;

  BlockState& s_;
  Facilities<V> facilities_;
};

}  // namespace terrace::cluster
