// SPDX-License-Identifier: Apache-2.0
// An allocation that fails while threads are started must not end the process. A separate program,
// as it replaces operator new: each allocation fails in turn, on whichever thread it is.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#include <gtest/gtest.h>

#include "for_blocks.hpp"

namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
std::atomic<std::int64_t> left{kNever};

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  void* memory = left.fetch_sub(1, std::memory_order_relaxed) > 0 ? std::malloc(size) : nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace terrace::tri {
namespace {

TEST(AllocationFailure, OfBlocksComesOut) {
  std::array<int, 1000> done{};
  const auto run = [&] {
    done.fill(0);
    for_blocks(
        done.size(), 10, 4, [] { return std::vector<int>(8); },
        [&](std::size_t begin, std::size_t end, std::vector<int>&) {
          for (std::size_t i = begin; i < end; ++i) done[i] = 1;
        });
  };
  left = kNever;
  run();
  const std::int64_t all = kNever - left;
  EXPECT_GT(all, 4);
  int thrown = 0;
  for (std::int64_t at = 0; at < all; ++at) {
    left = at;
    bool whole = true;
    try {
      run();
    } catch (const std::bad_alloc&) {
      whole = false;
    }
    left = kNever;
    thrown += whole ? 0 : 1;
    EXPECT_TRUE(!whole || std::ranges::count(done, 1) == 1000) << at;
  }
  EXPECT_GT(thrown, 0);
}

}  // namespace
}  // namespace terrace::tri
