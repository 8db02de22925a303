// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>

namespace terrace::base {
namespace {

/// Values of the reference implementation (S. Vigna, splitmix64.c) from the state 1234567.
TEST(Random, SplitmixAgreesWithTheReference) {
  std::uint64_t state = 1234567;
  for (const std::uint64_t expected :
       {6457827717110365317u, 3203168211198807973u, 9817491932198370423u, 4593380528125082431u,
        16408922859458223821u}) {
    EXPECT_EQ(splitmix64(state), expected);
    state += kGoldenGamma;
  }
  EXPECT_EQ(seed_of_run(1234567, 2), 9817491932198370423u);
}

TEST(Random, UnitIntervalIsHalfOpen) {
  EXPECT_EQ(unit_interval(0), 0.0);
  EXPECT_EQ(unit_interval(~std::uint64_t{0}), 1.0 - 0x1p-53);
}

TEST(Random, DrawsCoverTheirRangeEvenly) {
  std::mt19937_64 random(3);
  std::array<int, 7> counts{};
  constexpr int kDraws = 70'000;
  for (int i = 0; i < kDraws; ++i) ++counts[draw_below(counts.size(), random)];
  for (const int count : counts) EXPECT_NEAR(count, kDraws / 7, 500);
  EXPECT_EQ(draw_below(1, random), 0u);
}

TEST(Random, ShufflePermutes) {
  std::mt19937_64 random(4);
  std::vector<int> items(1000);
  std::iota(items.begin(), items.end(), 0);
  std::vector<int> shuffled = items;
  shuffle(shuffled, random);
  EXPECT_NE(shuffled, items);
  std::sort(shuffled.begin(), shuffled.end());
  EXPECT_EQ(shuffled, items);
}

}  // namespace
}  // namespace terrace::base
