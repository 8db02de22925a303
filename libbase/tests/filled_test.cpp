// SPDX-License-Identifier: Apache-2.0
#include "terrace/base/filled.hpp"

#include <array>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::base {
namespace {

struct Stop {};

using Item = std::array<float, 3>;
// 36 MB, so the check is called nine times.
constexpr std::size_t kFilledItems = 3'000'000;

TEST(Filled, ReturnsCopiesOfTheValue) {
  EXPECT_EQ(filled(kFilledItems, Item{1, 2, 3}, {}), std::vector(kFilledItems, Item{1, 2, 3}));
  EXPECT_TRUE(filled(0, 1, {}).empty());
  EXPECT_EQ(filled(3, 7, {}), (std::vector{7, 7, 7}));
}

TEST(Filled, ChecksEvery4MiB) {
  std::size_t calls = 0;
  const auto items = filled(kFilledItems, Item{}, [&] { ++calls; });
  EXPECT_EQ(items.size(), kFilledItems);
  EXPECT_EQ(calls, 9U);
}

TEST(Filled, StopsWhenTheCheckThrows) {
  constexpr std::size_t kLastCall = 9;
  std::size_t calls = 0;
  EXPECT_THROW(filled(kFilledItems, Item{},
                      [&] {
                        if (++calls == kLastCall) throw Stop();
                      }),
               Stop);
  EXPECT_EQ(calls, kLastCall);
}

}  // namespace
}  // namespace terrace::base
