// SPDX-License-Identifier: Apache-2.0
// A worker's exception must not end the process. Each allocation fails in turn, on any thread. This
// is a separate program, because it replaces operator new.
#include <atomic>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/cluster/hierarchy.hpp"

namespace {

std::atomic<std::int64_t> allocations_left{std::numeric_limits<std::int64_t>::max()};

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

namespace terrace::cluster {
namespace {

/// Calls work() about `times` times. In each call an allocation and all allocations after it fail,
/// a later one each time. Returns the number of calls that threw std::bad_alloc.
template <class Work>
int fail_in_turn(int times, const Work& work) {
  constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
  work();  // one-time initialisation
  allocations_left = kNever;
  work();
  const std::int64_t all = kNever - allocations_left.exchange(kNever);
  int thrown = 0;
  for (std::int64_t at = 0; at < all; at += std::max<std::int64_t>(1, all / times)) {
    allocations_left = at;
    try {
      work();
      allocations_left = kNever;
    } catch (const std::bad_alloc&) {
      allocations_left = kNever;
      ++thrown;
    }
  }
  return thrown;
}

struct Nowhere final : HierarchySink {
  std::unique_ptr<Prepared> prepare(const ClusteredBlock&) override {
    return std::make_unique<Prepared>();
  }
  void commit(unsigned, std::unique_ptr<Prepared>) override {}
  void root(const ClusteredBlock&) override {}
};

TEST(AllocationFailure, InTheHierarchyIsRethrown) {
  std::vector<Point3> points(3000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = static_cast<double>(i);
    points[i] = {static_cast<double>(i * 7919 % 1009), static_cast<double>(i * 104729 % 997), x};
  }
  const auto build = [&] {
    HierarchyOptions options;
    options.block_size = 100;
    options.threads = 4;
    Nowhere sink;
    HierarchyBuilder builder(options, sink);
    for (std::size_t i = 0; i < points.size(); i += 50) {
      builder.push(std::span(points).subspan(i, 50));
    }
    builder.finish();
  };
  EXPECT_GT(fail_in_turn(400, build), 100);
}

}  // namespace
}  // namespace terrace::cluster
