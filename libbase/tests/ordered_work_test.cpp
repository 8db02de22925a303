// SPDX-License-Identifier: Apache-2.0
#include "terrace/base/ordered_work.hpp"

#include <atomic>
#include <latch>
#include <memory>
#include <stdexcept>

#include <gtest/gtest.h>

namespace terrace::base {
namespace {

TEST(OrderedWork, CommitsEachResultOnceInOrder) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    for (const std::size_t count : {0U, 1U, 2U, 500U}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << count);
      std::atomic<unsigned> calls = 0;
      std::vector<std::size_t> committed;
      in_order(
          count, threads,
          [&](unsigned worker, std::size_t i) {
            EXPECT_LT(worker, threads);
            ++calls;
            if (i % 3 == 0) std::this_thread::yield();
            return std::make_unique<std::size_t>(i * i);  // need not be copyable
          },
          [&](std::size_t i, const std::unique_ptr<std::size_t>& result) {
            EXPECT_EQ(*result, i * i);
            committed.push_back(i);
          });
      EXPECT_EQ(calls, count);
      ASSERT_EQ(committed.size(), count);
      for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(committed[i], i);
    }
  }
}

TEST(OrderedWork, TakesItemsOneByOneAndCommitsInOrder) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    for (const std::size_t count : {0U, 1U, 2U, 500U}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << count);
      std::atomic<int> entered = 0;
      std::size_t issued = 0;
      std::vector<std::size_t> committed;
      each_in_order(
          threads,
          [&](unsigned) -> std::optional<std::unique_ptr<std::size_t>> {  // need not be copyable
            EXPECT_EQ(++entered, 1);
            if (issued % 5 == 0) std::this_thread::yield();
            --entered;
            if (issued == count) return {};
            return std::make_unique<std::size_t>(issued++);
          },
          [&](unsigned worker, std::unique_ptr<std::size_t> item) {
            EXPECT_LT(worker, std::max(1U, threads));
            if (*item % 3 == 0) std::this_thread::yield();
            return item;
          },
          [&](std::unique_ptr<std::size_t> item) { committed.push_back(*item); });
      ASSERT_EQ(committed.size(), count);
      for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(committed[i], i);
    }
  }
}

TEST(OrderedWork, CommitsItemsBeforeFailingNext) {
  for (const unsigned threads : {1U, 4U}) {
    std::size_t issued = 0, committed = 0;
    EXPECT_THROW(each_in_order(
                     threads,
                     [&](unsigned) -> std::optional<std::size_t> {
                       if (issued == 40) throw std::runtime_error("damaged");
                       return issued++;
                     },
                     [](unsigned, std::size_t i) { return i; },
                     [&](std::size_t i) { EXPECT_EQ(i, committed++); }),
                 std::runtime_error);
    EXPECT_EQ(committed, 40U);
  }
}

TEST(OrderedWork, CommitsOneAtATimeOnRequestedThreads) {
  std::atomic<int> committing = 0, working = 0, most = 0;
  std::vector<std::atomic<unsigned>> calls(3);
  std::latch all_workers(3);
  const auto enter = [&] {
    const int now = ++working;
    for (int previous = most; now > previous && !most.compare_exchange_weak(previous, now);) {
    }
  };
  in_order(
      300, 3,
      [&](unsigned worker, std::size_t i) {
        enter();
        ++calls[worker];
        if (i < 3) all_workers.arrive_and_wait();
        if (i % 7 == 0) std::this_thread::yield();
        --working;
        return i;
      },
      [&](std::size_t i, std::size_t) {
        enter();
        EXPECT_EQ(++committing, 1);
        if (i % 11 == 0) std::this_thread::yield();
        --committing;
        --working;
      });
  EXPECT_LE(most, 3);
  for (const std::atomic<unsigned>& own : calls) EXPECT_GT(own, 0U);
}

TEST(OrderedWork, RethrowsFirstError) {
  for (const unsigned threads : {1U, 4U}) {
    std::size_t last = 0;
    const auto run = [&] {
      in_order(
          1000, threads,
          [](unsigned, std::size_t i) {
            if (i >= 40) throw std::runtime_error("at " + std::to_string(i));
            return i;
          },
          [&](std::size_t i, std::size_t) { last = i; });
    };
    try {
      run();
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "at 40");
    }
    EXPECT_EQ(last, 39U);
  }
}

TEST(OrderedWork, StopsAfterCommitError) {
  std::atomic<unsigned> calls = 0;
  EXPECT_THROW(in_order(
                   1000, 4,
                   [&](unsigned, std::size_t i) {
                     ++calls;
                     return i;
                   },
                   [](std::size_t i, std::size_t) {
                     if (i == 10) throw std::runtime_error("full");
                   }),
               std::runtime_error);
  EXPECT_LT(calls, 1000U);
}

TEST(OrderedWork, EndsWhenCommitReturnsFalse) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    SCOPED_TRACE(threads);
    std::atomic<unsigned> calls = 0;
    std::size_t committed = 0;
    in_order(
        1000, threads,
        [&](unsigned, std::size_t i) {
          ++calls;
          return i;
        },
        [&](std::size_t i, std::size_t) {
          EXPECT_EQ(i, committed++);
          return i < 10;
        });
    EXPECT_EQ(committed, 11U);
    EXPECT_LT(calls, 1000U);
  }
}

TEST(OrderedWork, FailureAfterTheEndIsIgnored) {
  for (const unsigned threads : {1U, 4U}) {
    std::size_t committed = 0;
    in_order(
        100, threads,
        [&](unsigned, std::size_t i) {
          if (i > 10) throw std::runtime_error("not needed");
          return i;
        },
        [&](std::size_t i, std::size_t) {
          ++committed;
          return i < 10;
        });
    EXPECT_EQ(committed, 11U);
  }
}

}  // namespace
}  // namespace terrace::base
