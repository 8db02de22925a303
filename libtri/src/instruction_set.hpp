// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::tri {

/// The instruction sets for which inner loops are compiled; the best one supported is chosen at run
/// time.
enum class InstructionSet : std::uint8_t { kPortable, kAvx2, kAvx512 };
bool supported(InstructionSet set);
InstructionSet best_instruction_set();

}  // namespace terrace::tri
