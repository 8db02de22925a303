// SPDX-License-Identifier: Apache-2.0
// Compares boxes found in a tree with a linear search.
#include "surface/box_tree.hpp"

#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

TEST(BoxTree, VisitsBoxesThatMeetAQuery) {
  BoxTree tree;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const auto random_box = [&](std::uint64_t size) {
      StoredBox box;
      for (std::size_t k = 0; k < 2; ++k) {
        box.min[k] = static_cast<double>(random() % 100);
        box.max[k] = box.min[k] + static_cast<double>(random() % size);
      }
      return box;
    };
    // Trees of no box, one box and several boxes, with arbitrary numbers.
    std::vector<BoxTree::Item>& items = tree.start();
    for (std::uint64_t i = 0; i < seed * (seed - 1) / 2; ++i) {
      items.push_back({random_box(8), static_cast<std::uint32_t>(7 * i)});
    }
    const std::vector<BoxTree::Item> all = items;
    tree.build();
    for (int query = 0; query < 20; ++query) {
      const StoredBox box = random_box(query % 2 == 0 ? 3 : 40);
      std::multiset<std::uint32_t> found, expected;
      tree.visit([&](const StoredBox& other) { return box.intersects(other); },
                 [&](std::uint32_t number) { found.insert(number); });
      for (const BoxTree::Item& item : all) {
        if (box.intersects(item.box)) expected.insert(item.number);
      }
      EXPECT_EQ(found, expected);
    }
  }
}

}  // namespace
}  // namespace terrace::terrain
