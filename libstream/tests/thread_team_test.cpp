// SPDX-License-Identifier: Apache-2.0
#include "thread_team.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::stream {
namespace {

TEST(ThreadTeamTest, EveryCallIsMadeOnceByOneOfTheWorkers) {
  for (const unsigned threads : {0u, 1u, 2u, 5u}) {
    ThreadTeam team(threads);
    EXPECT_EQ(team.threads(), std::max(1u, threads));
    for (std::size_t count = 0; count < 200; ++count) {
      std::vector<std::atomic<int>> done(count);
      std::vector<std::size_t> last(team.threads());
      std::atomic<bool> in_order = true;
      team.run(count, [&](std::size_t i, std::size_t worker) {
        ++done[i];
        if (worker >= last.size() || i + 1 <= last[worker]) in_order = false;
        last[worker] = i + 1;
      });
      EXPECT_TRUE(in_order);
      for (const std::atomic<int>& times : done) EXPECT_EQ(times, 1);
    }
  }
}

TEST(ThreadTeamTest, AFailureComesOutAndTheTeamGoesOn) {
  for (const unsigned threads : {1u, 2u, 5u}) {
    ThreadTeam team(threads);
    std::atomic<int> calls = 0;
    for (int round = 0; round < 50; ++round) {
      EXPECT_THROW(team.run(100,
                            [](std::size_t i, std::size_t) {
                              if (i == 50) throw std::runtime_error("as asked");
                            }),
                   std::runtime_error);
      team.run(100, [&](std::size_t, std::size_t) { ++calls; });
    }
    EXPECT_EQ(calls, 50 * 100);
  }
}

}  // namespace
}  // namespace terrace::stream
