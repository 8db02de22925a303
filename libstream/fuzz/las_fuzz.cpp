// SPDX-License-Identifier: Apache-2.0
#include "fuzz_points.hpp"

/// Any input is read or refused, as LAS and LAZ. Neither the block size nor the number of threads
/// makes a difference.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  const ReadResult large = read_all_points(file.name(), {.format = "las", .block_points = 500});
  const ReadResult small = read_all_points(file.name(), {.format = "las", .block_points = 3});
  require(large == small, "points do not depend on the block size");
  const ReadResult threads =
      read_all_points(file.name(), {.format = "las", .block_points = 500, .threads = 2});
  require(large == threads, "points do not depend on the threads");
  // With on_damage an intact file gives the same points, and a damaged file gives as many as
  // possible.
  std::uint64_t lost = 0;
  const OnDamage count = [&lost](const Error&, std::uint64_t points) { lost += points; };
  const ReadResult rest =
      read_all_points(file.name(), {.format = "las", .block_points = 500, .on_damage = count});
  require(large.refused || rest == large, "an intact file is read completely");
  lost = 0;
  const ReadResult by_threads = read_all_points(
      file.name(), {.format = "las", .block_points = 500, .threads = 2, .on_damage = count});
  require(rest == by_threads, "points left of a damaged file do not depend on the threads");
  return 0;
}
