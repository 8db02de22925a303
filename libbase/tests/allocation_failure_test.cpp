// SPDX-License-Identifier: Apache-2.0
// Neither an exception on a thread nor a failed allocation while threads start may end the process.
// The tests make each allocation fail in turn, on any thread. They are a separate program because
// they replace operator new.
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
std::atomic<std::int64_t> allocations_left{kNever};

}  // namespace

// Inlined into only one of new and delete, they look to GCC like malloc() with delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* memory =
      allocations_left.fetch_sub(1, std::memory_order_relaxed) > 0 ? std::malloc(size) : nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace terrace::base {
namespace {

/// Calls run() repeatedly. In call k the k-th allocation and all later ones fail. Returns the
/// number of calls that threw std::bad_alloc. After any other call, complete() must return true.
template <class Run, class Complete>
int fail_in_turn(const Run& run, const Complete& complete) {
  run();  // one-time initialisation
  allocations_left = kNever;
  run();
  const std::int64_t all = kNever - allocations_left.exchange(kNever);
  EXPECT_GT(all, 4);
  int thrown = 0;
  for (std::int64_t at = 0; at < all; ++at) {
    allocations_left = at;
    bool completed = true;
    try {
      run();
    } catch (const std::bad_alloc&) {
      completed = false;
    }
    allocations_left = kNever;
    thrown += completed ? 0 : 1;
    EXPECT_TRUE(!completed || complete()) << at;
  }
  return thrown;
}

TEST(AllocationFailure, InALoopIsRethrown) {
  std::array<int, 1000> visits{};
  const auto run = [&] {
    visits.fill(0);
    parallel_blocks(
        visits.size(), 10, 4, [] { return std::vector<int>(8); },
        [&](std::size_t begin, std::size_t end, std::vector<int>&) {
          for (std::size_t i = begin; i < end; ++i) visits[i] = 1;
        });
  };
  EXPECT_GT(fail_in_turn(run, [&] { return std::ranges::count(visits, 1) == 1000; }), 0);
}

TEST(AllocationFailure, InATeamIsRethrown) {
  std::atomic<int> visits = 0;
  const auto run = [&] {
    visits = 0;
    ThreadTeam team(4);
    for (int round = 0; round < 5; ++round) {
      team.run(40, [&](std::size_t i) {
        std::vector<double>(i + 1).swap(*std::make_unique<std::vector<double>>());
        ++visits;
      });
    }
  };
  EXPECT_GT(fail_in_turn(run, [&] { return visits == 200; }), 50);
}

}  // namespace
}  // namespace terrace::base
