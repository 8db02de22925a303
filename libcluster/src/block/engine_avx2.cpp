// SPDX-License-Identifier: Apache-2.0
#include "block/engine_impl.hpp"
#include "block/simd_avx2.hpp"

namespace terrace::cluster {

void run_engine_avx2(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Avx2>(state).run(plan);
}

}  // namespace terrace::cluster
