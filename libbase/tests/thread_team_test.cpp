// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/thread_team.hpp>

namespace terrace::base {
namespace {

TEST(ThreadTeam, CallsEachTaskOnceInAscendingOrder) {
  for (const unsigned threads : {0u, 1u, 2u, 5u}) {
    ThreadTeam team(threads);
    EXPECT_EQ(team.threads(), std::max(1u, threads));
    for (std::size_t count = 0; count < 200; ++count) {
      std::vector<std::atomic<int>> done(count);
      std::vector<std::size_t> last(team.threads());
      std::atomic<bool> in_order = true;
      team.run(count, [&](std::size_t i, unsigned thread) {
        ++done[i];
        if (thread >= last.size() || i + 1 <= last[thread]) in_order = false;
        last[thread] = i + 1;
      });
      EXPECT_TRUE(in_order);
      for (const std::atomic<int>& times : done) ASSERT_EQ(times, 1) << count;
    }
  }
}

TEST(ThreadTeam, WakesSleepingThreads) {
  ThreadTeam team(4);
  for (int round = 0; round < 3; ++round) {
    // Two tasks that wait for each other need two threads.
    std::atomic<int> arrivals = 0;
    team.run(2, [&](std::size_t) {
      ++arrivals;
      while (arrivals < 2) std::this_thread::yield();
    });
    EXPECT_EQ(arrivals, 2);
    // Long enough for threads to fall asleep; the test holds if they have not.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

TEST(ThreadTeam, RethrowsTheExceptionOfTheLowestTask) {
  for (const unsigned threads : {1u, 2u, 5u}) {
    ThreadTeam team(threads);
    for (int round = 0; round < 50; ++round) {
      std::atomic<int> running = 0;
      try {
        team.run(100, [&](std::size_t i) {
          ++running;
          if (i >= 10 && i % 2 == 0) {
            --running;
            throw std::runtime_error(std::to_string(i));
          }
          --running;
        });
        FAIL() << "nothing was thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "10");
      }
      EXPECT_EQ(running, 0);
      std::atomic<int> calls = 0;
      team.run(100, [&](std::size_t) { ++calls; });
      EXPECT_EQ(calls, 100);
    }
  }
}

// The caller finishes first and must not miss the wake-up.
TEST(ThreadTeam, WaitsForLongTasks) {
  ThreadTeam team(3);
  for (int round = 0; round < 5; ++round) {
    std::atomic<int> done = 0;
    team.run(3, [&](std::size_t i) {
      if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(15));
      ++done;
    });
    EXPECT_EQ(done, 3);
  }
}

}  // namespace
}  // namespace terrace::base
