// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/parallel.hpp>

namespace terrace::base {
namespace {

TEST(Parallel, UsesNoMoreThreadsThanParts) {
  EXPECT_EQ(threads_for(0, 8), 1u);
  EXPECT_EQ(threads_for(3, 8), 3u);
  EXPECT_EQ(threads_for(100, 8), 8u);
  EXPECT_EQ(threads_for(100'000, 100'000), 256u);
  EXPECT_EQ(threads_for(100'000, 0),
            std::min(256u, std::max(1u, std::thread::hardware_concurrency())));
}

TEST(Parallel, VisitsEveryNumberOnce) {
  for (const unsigned threads : {1u, 2u, 7u}) {
    for (const std::size_t count : {0u, 1u, 2u, 999u}) {
      std::vector<std::atomic<int>> done(count);
      parallel_for(count, threads, [&](std::size_t i) { ++done[i]; });
      for (const auto& times : done) ASSERT_EQ(times, 1);
      parallel_blocks(count, 10, threads, [&](std::size_t begin, std::size_t end) {
        EXPECT_EQ(begin % 10, 0u);
        EXPECT_LE(end - begin, 10u);
        for (std::size_t i = begin; i < end; ++i) ++done[i];
      });
      for (const auto& times : done) ASSERT_EQ(times, 2);
    }
  }
}

TEST(Parallel, GivesEachThreadItsHelper) {
  std::atomic<int> made = 0;
  std::atomic<int> sum = 0;
  parallel_blocks(
      1000, 7, 4,
      [&] {
        ++made;
        return std::make_unique<int>(0);
      },
      [&](std::size_t begin, std::size_t end, std::unique_ptr<int>& helper) {
        *helper += static_cast<int>(end - begin);
        sum += static_cast<int>(end - begin);
      });
  EXPECT_EQ(sum, 1000);
  EXPECT_GE(made, 1);
  EXPECT_LE(made, 4);
}

TEST(Parallel, RethrowsTheFirstFailure) {
  for (const unsigned threads : {1u, 4u}) {
    try {
      parallel_for(1000, threads, [](std::size_t i) {
        if (i >= 3) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
  }
}

}  // namespace
}  // namespace terrace::base
