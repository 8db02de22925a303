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
  // An intact file is read the same if damage is left out; of a damaged file as much as possible is
  // read.
  std::uint64_t told = 0;
  const OnDamage count = [&told](const Error&, std::uint64_t points) { told += points; };
  const Reading rest =
      read_through(file.name(), {.format = "las", .block_points = 500, .on_damage = count});
  require(large.refused || rest == large, "nothing left out of what is whole");
  told = 0;
  const Reading by_threads = read_through(
      file.name(), {.format = "las", .block_points = 500, .threads = 2, .on_damage = count});
  require(rest == by_threads, "the same rest by any number of threads");
  return 0;
}
