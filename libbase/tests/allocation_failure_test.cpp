// SPDX-License-Identifier: Apache-2.0
// A thread's exception must not end the process, nor may an allocation that fails while threads are
// started. A separate program, as it replaces operator new: each allocation fails in turn, on
// whichever thread it is.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/parallel.hpp>

namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
std::atomic<std::int64_t> left{kNever};

}  // namespace

// Inlined into only one of new and delete, they look to GCC like malloc() with delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* memory = left.fetch_sub(1, std::memory_order_relaxed) > 0 ? std::malloc(size) : nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace terrace::base {
namespace {

/// Calls run() repeatedly, with the first allocation and all after it failing, then all from the
/// second on, and so on. Returns how often it threw std::bad_alloc. After a call that did not
/// throw, complete() must hold.
template <class Run, class Complete>
int fail_in_turn(const Run& run, const Complete& complete) {
  run();  // one-time initialisation
  left = kNever;
  run();
  const std::int64_t all = kNever - left.exchange(kNever);
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
    EXPECT_TRUE(!whole || complete()) << at;
  }
  return thrown;
}

TEST(AllocationFailure, OfALoopIsRethrown) {
  std::array<int, 1000> done{};
  const auto run = [&] {
    done.fill(0);
    parallel_blocks(
        done.size(), 10, 4, [] { return std::vector<int>(8); },
        [&](std::size_t begin, std::size_t end, std::vector<int>&) {
          for (std::size_t i = begin; i < end; ++i) done[i] = 1;
        });
  };
  EXPECT_GT(fail_in_turn(run, [&] { return std::ranges::count(done, 1) == 1000; }), 0);
}

TEST(AllocationFailure, OfATeamIsRethrown) {
  std::atomic<int> done = 0;
  const auto run = [&] {
    done = 0;
    ThreadTeam team(4);
    for (int round = 0; round < 5; ++round) {
      team.run(40, [&](std::size_t i) {
        std::vector<double>(i + 1).swap(*std::make_unique<std::vector<double>>());
        ++done;
      });
    }
  };
  EXPECT_GT(fail_in_turn(run, [&] { return done == 200; }), 50);
}

}  // namespace
}  // namespace terrace::base
