// SPDX-License-Identifier: Apache-2.0
#include "block/engine_impl.hpp"
#include "block/simd_portable.hpp"

namespace terrace::cluster {

void run_engine_portable(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Portable>(state).run(plan);
}

}  // namespace terrace::cluster
