// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::tri {

/// What inner loops are compiled for; the best that the processor supports is chosen at run time.
enum class InstructionSet : std::uint8_t { kPortable, kAvx2, kAvx512 };
bool supported(InstructionSet set);
InstructionSet best_instruction_set();

}  // namespace terrace::tri
