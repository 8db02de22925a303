// SPDX-License-Identifier: Apache-2.0
// The entry point for libFuzzer.
#include "fuzz_target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const terrace::terrain::fuzz::WorkLimit limit(size);
  terrace::terrain::fuzz::accepts(data, size);
  return 0;
}
