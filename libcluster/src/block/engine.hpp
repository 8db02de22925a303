// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/state.hpp"

namespace terrace::cluster {

/// The steps of a search and their lengths.
struct SearchPlan {
  std::uint32_t random_candidates = 0;  ///< if positive, replaces the sweeps
  std::uint32_t sweeps = 1;             ///< number of sweeps along the curve
  float candidates = 3.0f;              ///< candidates per facility and sweep, at least
  std::uint32_t max_spacing = 32;       ///< largest number of points between candidates
  std::uint32_t polish = 1;             ///< rounds of moving facilities and assigning all points
  std::uint64_t seed = 1;               ///< seed of the random candidates
};

/// Clusters the block: fills facilities (in curve order) and nearest.
using EngineFunction = void (*)(BlockState& state, const SearchPlan& plan);

void run_engine_portable(BlockState& state, const SearchPlan& plan);
void run_engine_avx2(BlockState& state, const SearchPlan& plan);
void run_engine_avx512(BlockState& state, const SearchPlan& plan);

}  // namespace terrace::cluster
