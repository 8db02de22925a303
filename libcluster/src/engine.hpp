// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block_state.hpp"

namespace terrace::cluster {

/// How long and how the engine searches.
struct SearchPlan {
  std::uint32_t random_candidates = 0;  ///< the thesis's search, if not 0
  std::uint32_t sweeps = 1;             ///< over the groups of the curve
  std::uint32_t stride = 2;             ///< a sweep visits every stride-th group
  std::uint32_t polish = 1;             ///< rounds of moving facilities and reassigning
  std::uint64_t seed = 1;
};

/// Clusters the block: fills facilities (in curve order) and nearest.
using EngineFunction = void (*)(BlockState& state, const SearchPlan& plan);

void run_engine_portable(BlockState& state, const SearchPlan& plan);
void run_engine_avx2(BlockState& state, const SearchPlan& plan);
void run_engine_avx512(BlockState& state, const SearchPlan& plan);

}  // namespace terrace::cluster
