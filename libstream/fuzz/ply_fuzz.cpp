// SPDX-License-Identifier: Apache-2.0
#include "fuzz_points.hpp"

/// Any input is read or refused, and the block size does not make a difference.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  WorkLimit limit(size);
  const MemoryFile file(data, size);
  const ReadResult large = read_all_points(file.name(), {.format = "ply", .block_points = 500});
  const ReadResult small = read_all_points(file.name(), {.format = "ply", .block_points = 3});
  require(large == small, "points do not depend on the block size");
  limit.add(large.points);
  read_all_points(file.name(), {});
  return 0;
}
