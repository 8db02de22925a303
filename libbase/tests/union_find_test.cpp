// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/union_find.hpp>

namespace terrace::base {
namespace {

/// Oracle: labels that each union rewrites.
TEST(UnionFind, AgreesWithRelabelling) {
  std::mt19937 random(11);
  for (const std::uint32_t count : {1u, 2u, 10u, 300u}) {
    UnionFind sets(count);
    std::vector<std::uint32_t> label(count);
    for (std::uint32_t i = 0; i < count; ++i) label[i] = i;
    std::uniform_int_distribution<std::uint32_t> draw(0, count - 1);
    for (std::uint32_t step = 0; step < count; ++step) {
      const std::uint32_t a = draw(random), b = draw(random);
      const std::uint32_t keep = std::min(label[a], label[b]), drop = std::max(label[a], label[b]);
      EXPECT_EQ(sets.unite(a, b), keep != drop);
      std::replace(label.begin(), label.end(), drop, keep);
    }
    EXPECT_EQ(sets.sets(), std::set(label.begin(), label.end()).size());
    for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(sets.find(i), label[i]);
    for (std::uint32_t i = 0; i < count; ++i) sets.flatten(i);
    for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(sets.flat(i), label[i]);
  }
}

/// A long chain, as unions of neighbours from the far end give.
TEST(UnionFind, FlattensChains) {
  constexpr std::uint32_t kCount = 100'000;
  UnionFind sets(kCount);
  for (std::uint32_t i = kCount - 1; i > 0; --i) sets.unite(i - 1, i);
  EXPECT_EQ(sets.sets(), 1u);
  for (std::uint32_t i = 0; i < kCount; ++i) sets.flatten(i);
  for (std::uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(sets.flat(i), 0u);
}

}  // namespace
}  // namespace terrace::base
