// SPDX-License-Identifier: Apache-2.0
#include "terrace/base/filled.hpp"

#include <array>

#include <gtest/gtest.h>

namespace terrace::base {
namespace {

struct Stop {};

TEST(Filled, HasTheRequestedLengthAndStopsAtACheck) {
  constexpr std::size_t kCount = 3'000'000;
  std::size_t calls = 0;
  const auto values = filled(kCount, std::array<float, 3>{1, 2, 3}, [&] { ++calls; });
  EXPECT_EQ(values, std::vector(kCount, std::array<float, 3>{1, 2, 3}));
  EXPECT_GE(calls, 9U);
  const std::size_t all = calls;
  calls = 0;
  EXPECT_THROW(filled(kCount, std::array<float, 3>{},
                      [&] {
                        if (++calls == all) throw Stop();
                      }),
               Stop);
  EXPECT_EQ(calls, all);
  EXPECT_TRUE(filled(0, 1, {}).empty());
  EXPECT_EQ(filled(3, 7, {}), (std::vector{7, 7, 7}));
}

}  // namespace
}  // namespace terrace::base
