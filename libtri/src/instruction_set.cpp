// SPDX-License-Identifier: Apache-2.0
#include "instruction_set.hpp"

namespace terrace::tri {

bool supported(InstructionSet set) {
#ifdef TERRACE_TRI_X86
  if (set == InstructionSet::kAvx2) return __builtin_cpu_supports("avx2") != 0;
  if (set == InstructionSet::kAvx512)
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
#endif
  return set == InstructionSet::kPortable;
}

InstructionSet best_instruction_set() {
  static const InstructionSet best = supported(InstructionSet::kAvx512) ? InstructionSet::kAvx512
                                     : supported(InstructionSet::kAvx2) ? InstructionSet::kAvx2
                                                                        : InstructionSet::kPortable;
  return best;
}

}  // namespace terrace::tri
