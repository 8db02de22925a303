// SPDX-License-Identifier: Apache-2.0
#include "terrace/base/work_ahead.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace terrace::base {
namespace {

struct Square {
  std::size_t number = 0, square = 0;
  std::unique_ptr<int> only_moves{};
};

WorkAhead<Square>::Work squares() {
  return [](Square& task) {
    if (task.number % 3 == 0) std::this_thread::yield();
    task.square = task.number * task.number;
  };
}

TEST(WorkAhead, ReturnsTasksDoneAndInOrder) {
  for (const unsigned threads : {0U, 1U, 2U, 7U}) {
    for (const std::size_t limit : {1U, 2U, 20U}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << limit << " ahead");
      WorkAhead<Square> ahead(threads, squares);
      std::size_t taken = 0;
      const auto take = [&] {
        const Square task = ahead.take();
        EXPECT_EQ(task.number, taken);
        EXPECT_EQ(task.square, taken * taken);
        ++taken;
      };
      for (std::size_t i = 0; i < 500; ++i) {
        if (ahead.size() == limit) take();
        ahead.give({.number = i});
      }
      EXPECT_EQ(ahead.size(), limit);
      EXPECT_LE(ahead.threads(), threads);
      while (ahead.size() > 0) take();
      EXPECT_EQ(taken, 500u);
    }
  }
}

TEST(WorkAhead, CreatesTheWorkOncePerThreadAndOnlyForTasks) {
  for (const unsigned threads : {0U, 3U}) {
    std::atomic<unsigned> created = 0;
    {
      WorkAhead<int> idle(threads, [&] {
        ++created;
        return [](int&) {};
      });
    }
    EXPECT_EQ(created, 0u);
    WorkAhead<int> ahead(threads, [&] {
      ++created;
      return [](int& task) { ++task; };
    });
    for (int i = 0; i < 50; ++i) ahead.give(i);
    for (int i = 0; i < 50; ++i) EXPECT_EQ(ahead.take(), i + 1);
    EXPECT_GE(created, 1u);
    EXPECT_LE(created, std::max(1u, threads));
  }
}

TEST(WorkAhead, RethrowsForTheTaskThatFailedAndContinues) {
  for (const unsigned threads : {0U, 1U, 4U}) {
    WorkAhead<int> ahead(threads, [] {
      return [](int& task) {
        if (task % 5 == 0) throw std::runtime_error(std::to_string(task));
      };
    });
    for (int i = 0; i < 50; ++i) ahead.give(i);
    for (int i = 0; i < 50; ++i) {
      try {
        EXPECT_EQ(ahead.take(), i);
        EXPECT_NE(i % 5, 0);
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), std::to_string(i));
        EXPECT_EQ(i % 5, 0);
      }
    }
    EXPECT_EQ(ahead.size(), 0u);
  }
}

TEST(WorkAhead, RethrowsWhenTheWorkCannotBeCreated) {
  for (const unsigned threads : {0U, 2U}) {
    WorkAhead<int> ahead(threads, []() -> WorkAhead<int>::Work { throw std::runtime_error("no"); });
    ahead.give(1);
    EXPECT_THROW(ahead.take(), std::runtime_error);
  }
}

TEST(WorkAhead, DestructorDropsTasksThatHaveNotBegun) {
  std::atomic<int> completed = 0;
  {
    WorkAhead<int> ahead(2, [&] {
      return [&](int&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        ++completed;
      };
    });
    for (int i = 0; i < 1000; ++i) ahead.give(i);
    ahead.take();
  }
  EXPECT_GE(completed, 1);
  EXPECT_LT(completed, 1000);
}

}  // namespace
}  // namespace terrace::base
