// SPDX-License-Identifier: GPL-3.0-or-later
// What libFuzzer calls.
#include "fuzz_target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  terrace::tools::accepts(data, size);
  return 0;
}
