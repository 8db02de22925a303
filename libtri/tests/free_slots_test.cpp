// SPDX-License-Identifier: Apache-2.0
#include "free_slots.hpp"

#include <random>
#include <set>

#include <gtest/gtest.h>

namespace terrace::tri {
namespace {

TEST(FreeSlots, TakesEachSlotOnce) {
  std::mt19937_64 random(1);
  FreeSlots slots;
  std::set<std::uint32_t> expected;
  for (int step = 0; step < 20000; ++step) {
    SCOPED_TRACE(step);
    const bool growing = step / 1000 % 2 == 0;
    if (random() % 4 < (growing ? 3u : 1u)) {
      const auto slot = static_cast<std::uint32_t>(random() % 1000);
      if (expected.insert(slot).second) slots.put(slot);
      EXPECT_TRUE(slots.contains(slot));
    } else if (!expected.empty()) {
      const std::uint32_t next = slots.next();
      const std::uint32_t slot = slots.take();
      EXPECT_EQ(slot, next);
      ASSERT_EQ(expected.erase(slot), 1u);
      EXPECT_FALSE(slots.contains(slot));
    }
    ASSERT_EQ(slots.empty(), expected.empty());
    ASSERT_EQ(slots.count(), expected.size());
  }
}

TEST(FreeSlots, ReusesSlotsInOrderHoweverFreed) {
  FreeSlots slots;
  for (const std::uint32_t slot : {70u, 5u, 127u, 3u, 64u, 9u}) slots.put(slot);
  for (const std::uint32_t slot : {3u, 5u, 9u, 64u, 70u, 127u}) EXPECT_EQ(slots.take(), slot);
  EXPECT_TRUE(slots.empty());
  slots.put(1);
  slots.clear();
  EXPECT_TRUE(slots.empty());
  EXPECT_FALSE(slots.contains(1));
}

}  // namespace
}  // namespace terrace::tri
