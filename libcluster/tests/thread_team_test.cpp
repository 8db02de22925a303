// SPDX-License-Identifier: Apache-2.0
#include "thread_team.hpp"

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "waiting_threads.hpp"

namespace terrace::cluster {
namespace {

TEST(ThreadTeam, EveryPieceIsDoneOnce) {
  for (const unsigned threads : {1u, 2u, 5u}) {
    ThreadTeam team(threads);
    for (std::size_t count = 0; count < 200; ++count) {
      std::vector<std::atomic<int>> done(count);
      team.run(count, [&](std::size_t k) { ++done[k]; });
      for (std::size_t k = 0; k < count; ++k) ASSERT_EQ(done[k], 1) << k << " of " << count;
    }
  }
}

TEST(ThreadTeam, ThreadsThatSleptWakeUp) {
  ThreadTeam team(4);
  for (int round = 0; round < 3; ++round) {
    wait_until_others_wait();
    // Two pieces that wait for each other need two threads.
    std::atomic<int> met = 0;
    team.run(2, [&](std::size_t) {
      ++met;
      while (met < 2) std::this_thread::yield();
    });
    EXPECT_EQ(met, 2);
  }
}

TEST(ThreadTeam, ExceptionsComeOutWhenNothingRuns) {
  for (const unsigned threads : {1u, 3u}) {
    ThreadTeam team(threads);
    for (int round = 0; round < 50; ++round) {
      std::atomic<int> running = 0;
      EXPECT_THROW(team.run(100,
                            [&](std::size_t k) {
                              ++running;
                              if (k == 10) {
                                --running;
                                throw std::runtime_error("ten");
                              }
                              --running;
                            }),
                   std::runtime_error);
      EXPECT_EQ(running, 0);
      int sum = 0;
      team.run(1, [&](std::size_t) { ++sum; });
      EXPECT_EQ(sum, 1);
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
