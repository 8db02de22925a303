// SPDX-License-Identifier: Apache-2.0
#include "block/engine_impl.hpp"
#include "block/simd_avx512.hpp"

namespace terrace::cluster {

void run_engine_avx512(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Avx512>(state).run(plan);
}

}  // namespace terrace::cluster
