// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/engine_assign.hpp"

namespace terrace::cluster {

/// Opens the initial facilities, at equal distances along the curve. Their number follows from the
/// costs of runs of the curve.
template <class V>
class Seeder {
 public:
  explicit Seeder(BlockState& state) : s_(state) {}

  void seed() {
    const float optimum = optimal_count() + 0.5f;
    auto target = static_cast<std::uint32_t>(optimum);
    target = target < 1 ? 1 : target > s_.count ? s_.count : target;
    s_.facility_count = 0;
    s_.reserve_facilities(target + target / 2);
    for (std::uint32_t k = 0; k < target; ++k) {
      s_.add_facility(
          static_cast<std::uint32_t>((std::uint64_t{2} * k + 1) * s_.count / (2 * target)));
    }
  }

 private:
  /// Returns the number of facilities of least cost if each serves a run of the curve.
  float optimal_count() {
    // Evaluates runs of 16, 32, 64, ... points until their cost has been rising for a while.
    constexpr int kMaxLevels = 24;
    float total[kMaxLevels];
    float connection[kMaxLevels];
    int levels = 0;
    int best = 0;
    const float points = static_cast<float>(s_.count);
    for (std::uint32_t length = kLanes; levels < kMaxLevels; length *= 2) {
      connection[levels] = run_cost(length);
      total[levels] = s_.facility_cost * points / static_cast<float>(length) + connection[levels];
      if (total[levels] < total[best]) best = levels;
      ++levels;
      if (length >= s_.count || levels > best + 3) break;
    }
    const float count = points / static_cast<float>(kLanes << best);
    if (best + 1 >= levels) return count;
    if (best == 0) return extrapolated_count(count, total[0], connection[0], connection[1]);

    // Fits a parabola through the least cost and its neighbours, over the logarithm of the length.
    const float shorter_cost = total[best - 1];
    const float longer_cost = total[best + 1];
    const float curvature = shorter_cost - 2 * total[best] + longer_cost;
    const float shift = curvature > 0 ? 0.5f * (shorter_cost - longer_cost) / curvature : 0.0f;
    // 2^-shift for |shift| <= 1/2
    const float stretch = 1.0f + shift * (-0.69315f + shift * (0.24023f - shift * 0.0555f));
    // Runs of a curve are longer than good clusters if the points fill an area or a volume, which
    // makes many facilities look cheaper than they are. The growth of the cost when the length is
    // multiplied by four indicates the dimension: about 4 on a line, 2 on a surface. Fitted
    // empirically.
    const float growth =
        connection[best - 1] > 0 ? connection[best + 1] / connection[best - 1] : 4.0f;
    const float correction = 0.7f + 0.3f * (growth - 2.3f) / 0.73f;
    return count * stretch * (correction < 0.7f ? 0.7f : correction > 1.0f ? 1.0f : correction);
  }

  /// Extrapolates to fewer than sixteen points per run, assuming that the cost falls as it does
  /// from 32 points to 16.
  float extrapolated_count(float count, float total, float cost16, float cost32) {
    const float growth = cost16 > 0 ? cost32 / cost16 : 1.0f;
    float connection = cost16;
    for (int halvings = 0; growth > 1 && halvings < 4; ++halvings) {
      connection /= growth;
      const float next = s_.facility_cost * 2 * count + connection;
      if (!(next < total)) break;
      total = next;
      count *= 2;
    }
    return count;
  }

  /// Returns the sum of w d over runs of `length` points, where d is the distance to the run's
  /// centre of mass. length: a multiple of sixteen.
  float run_cost(std::uint32_t length) {
    const std::uint32_t end = round_to_lanes(s_.count);
    V total = V::broadcast(0);
    for (std::uint32_t first = 0; first < end; first += length) {
      const std::uint32_t last = first + length < end ? first + length : end;
      V sw = V::broadcast(0);
      V sx = sw;
      V sy = sw;
      V sz = sw;
      for (std::uint32_t i = first; i < last; i += kLanes) {
        const V w = V::load(s_.w + i);
        sw = sw + w;
        sx = sx + w * V::load(s_.x + i);
        sy = sy + w * V::load(s_.y + i);
        sz = sz + w * V::load(s_.z + i);
      }
      const float weight = sum(sw);
      const float inverse = weight > 0 ? 1.0f / weight : 0.0f;
      const V cx = V::broadcast(sum(sx) * inverse);
      const V cy = V::broadcast(sum(sy) * inverse);
      const V cz = V::broadcast(sum(sz) * inverse);
      for (std::uint32_t i = first; i < last; i += kLanes) {
        const V d =
            sqrt(squared(V::load(s_.x + i), V::load(s_.y + i), V::load(s_.z + i), cx, cy, cz));
        total = total + V::load(s_.w + i) * d;
      }
    }
    return sum(total);
  }

  BlockState& s_;
};

}  // namespace terrace::cluster
