// SPDX-License-Identifier: Apache-2.0
#include "fuzz_points.hpp"

/// Any bytes are read or refused, LAS and LAZ; neither the size of the blocks nor the number of
/// threads makes a difference.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  const Reading large = read_through(file.name(), {.format = "las", .block_points = 500});
  const Reading small = read_through(file.name(), {.format = "las", .block_points = 3});
  require(large == small, "the same points in blocks of any size");
  const Reading threads =
      read_through(file.name(), {.format = "las", .block_points = 500, .threads = 2});
  require(large == threads, "the same points by any number of threads");
  return 0;
}
