// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/engine.hpp"
#include "block/engine_assign.hpp"
#include "block/engine_facilities.hpp"
#include "block/engine_gain.hpp"
#include "block/engine_seed.hpp"
#include "block/engine_segments.hpp"

// The engine and its parts are templates over a vector of sixteen floats (simd_*.hpp), compiled
// once for each instruction set. They call no library function, because one compiled for newer
// processors might end up in code for all processors (tests/check_symbols.sh). Where memory has to
// grow they call BlockState, which is compiled for every processor.

namespace terrace::cluster {

/// The clustering engine: seeds facilities, improves them by local search, and assigns all points.
template <class V>
class Engine {
 public:
  explicit Engine(BlockState& state)
      : s_(state), assigner_(state), facilities_(state), step_(state) {}

  void run(const SearchPlan& plan) {
    assigner_.measure_groups();
    Seeder<V>(s_).seed();
    partition();
    recentre_all();
    if (plan.random_candidates > 0) {
      search_random(plan);
    } else {
      for (std::uint32_t round = 0; round < plan.sweeps; ++round) sweep(round, plan);
    }
    open_overpriced();
    for (std::uint32_t round = 0; round < plan.polish; ++round) {
      if (round > 0) partition();
      recentre_all();
    }
    s_.sort_facilities();
    assigner_.assign();
  }

 private:
  /// Assigns every point to its nearest facility and rebuilds the segments.
  void partition() {
    assigner_.assign();
    Segments<V>(s_).build();
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) facilities_.summarise(j);
  }

  void recentre_all() {
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) facilities_.recentre(j);
  }

  /// Opens a facility at the point if that lowers the cost.
  void consider(std::uint32_t point) {
    s_.tick(s_.facility_count / kLanes + 64);
    if (step_.evaluate(s_.x[point], s_.y[point], s_.z[point]) > 0) step_.open(point);
  }

  /// Tries points at equal distances along the curve.
  void sweep(std::uint32_t round, const SearchPlan& plan) {
    const float candidates = plan.candidates * static_cast<float>(s_.facility_count);
    auto spacing = static_cast<std::uint32_t>(static_cast<float>(s_.count) / candidates);
    spacing = spacing < 1 ? 1 : spacing > plan.max_spacing ? plan.max_spacing : spacing;
    const std::uint32_t visits = (s_.count + spacing - 1) / spacing;
    // The steps are near the golden section of the number of visits. So points that a change
    // affects are seldom tried right after it.
    auto step = static_cast<std::uint32_t>(static_cast<float>(visits) * 0.618034f);
    if (step == 0) step = 1;
    while (common_divisor(step, visits) != 1) ++step;
    const std::uint32_t offset = (2 * round + 1) * spacing / (2 * plan.sweeps);
    std::uint32_t visit = 0;
    for (std::uint32_t k = 0; k < visits; ++k) {
      const std::uint32_t point = visit * spacing + offset;
      consider(point < s_.count ? point : s_.count - 1);
      visit = (visit + step) % visits;
    }
  }

  /// Opens facilities at points that pay more than a facility costs.
  void open_overpriced() {
    std::uint32_t count = 0;
    const V limit = V::broadcast(s_.facility_cost);
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) {
      const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
      for (std::uint32_t i = s_.begin[j]; i < end; i += kLanes) {
        const typename V::Mask overpriced = less(limit, V::load(s_.pw + i) * V::load(s_.pd + i));
        for (std::uint32_t bits = overpriced.bits(); bits != 0; bits &= bits - 1) {
          const std::uint32_t slot = i + static_cast<std::uint32_t>(__builtin_ctz(bits));
          s_.nearest[count++] = static_cast<std::uint32_t>(s_.pp[slot]);
        }
      }
    }
    for (std::uint32_t k = 0; k < count; ++k) consider(s_.nearest[k]);
  }

  /// Tries random points.
  void search_random(const SearchPlan& plan) {
    std::uint64_t state = plan.seed;
    for (std::uint32_t k = 0; k < plan.random_candidates; ++k) {
      // SplitMix64
      state += 0x9e3779b97f4a7c15u;
      std::uint64_t bits = state;
      bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
      bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
      bits ^= bits >> 31;
      consider(static_cast<std::uint32_t>(((bits >> 32) * s_.count) >> 32));
    }
  }

  static std::uint32_t common_divisor(std::uint32_t a, std::uint32_t b) {
    while (b != 0) {
      const std::uint32_t rest = a % b;
      a = b;
      b = rest;
    }
    return a;
  }

  BlockState& s_;
  Assigner<V> assigner_;
  Facilities<V> facilities_;
  CandidateStep<V> step_;
};

}  // namespace terrace::cluster
