// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/bounding_volume_hierarchy.hpp"

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#include "tree_oracles.hpp"

namespace terrace::matching {
namespace {

using oracles::uniform;

template <std::size_t D>
std::vector<base::Box<D>> random_boxes(std::size_t n, double size, std::mt19937_64& random) {
  std::vector<base::Box<D>> boxes(n);
  for (base::Box<D>& box : boxes) {
    for (std::size_t d = 0; d < D; ++d) {
      box.min[d] = 10.0 * uniform(random) - 3.0;
      box.max[d] = box.min[d] + size * uniform(random);
    }
  }
  return boxes;
}

template <std::size_t D>
void expect_sound(const BoundingVolumeHierarchy<D>& tree, const std::vector<base::Box<D>>& boxes,
                  std::uint32_t leaf_size) {
  const auto nodes = tree.nodes();
  const auto order = tree.order();
  ASSERT_EQ(order.size(), boxes.size());
  std::vector<std::uint32_t> sorted(order.begin(), order.end());
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  if (boxes.empty()) {
    EXPECT_TRUE(nodes.empty());
    return;
  }
  struct Open {
    std::size_t node, depth;
  };
  std::vector<Open> open{{0, 0}};
  std::size_t seen = 0, slots = 0, deepest = 0;
  // Nodes and slots must be consecutive in a walk that visits the first child first.
  while (!open.empty()) {
    const auto [at, depth] = open.back();
    open.pop_back();
    ASSERT_EQ(at, seen++);
    const auto& node = nodes[at];
    if (node.count == 0) {
      ASSERT_GT(node.link, at + 1);
      ASSERT_LT(node.link, nodes.size());
      for (const std::size_t child : {at + 1, std::size_t{node.link}}) {
        for (std::size_t d = 0; d < D; ++d) {
          EXPECT_LE(node.min[d], nodes[child].min[d]);
          EXPECT_GE(node.max[d], nodes[child].max[d]);
        }
      }
      open.push_back({node.link, depth + 1});
      open.push_back({at + 1, depth + 1});
      continue;
    }
    deepest = std::max(deepest, depth);
    EXPECT_LE(node.count, leaf_size);
    EXPECT_EQ(node.link, slots);
    slots += node.count;
    for (std::uint32_t slot = node.link; slot < slots; ++slot) {
      const auto& frame = tree.frame();
      for (std::size_t d = 0; d < D; ++d) {
        const long double centre = frame.centre[d], scale = frame.scale;
        EXPECT_LE(static_cast<long double>(node.min[d]),
                  scale * static_cast<long double>(boxes[order[slot]].min[d]) - centre);
        EXPECT_GE(static_cast<long double>(node.max[d]),
                  scale * static_cast<long double>(boxes[order[slot]].max[d]) - centre);
      }
    }
  }
  EXPECT_EQ(seen, nodes.size());
  EXPECT_EQ(slots, boxes.size());
  EXPECT_EQ(tree.depth(), deepest);
}

template <std::size_t D>
double area(const base::Box<D>& box) {
  if constexpr (D == 2) return 2.0 * (box.max[0] - box.min[0] + box.max[1] - box.min[1]);
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) {
    sum += 2.0 * (box.max[d] - box.min[d]) * (box.max[(d + 1) % D] - box.min[(d + 1) % D]);
  }
  return sum;
}

/// Returns the cost below node v, times area, of every choice of leaves. Also computes v's box and
/// size.
template <std::size_t D>
std::vector<double> all_costs(const std::vector<TreeChildren>& rows,
                              const std::vector<base::Box<D>>& boxes, std::uint32_t v,
                              std::uint32_t leaf_size, const SurfaceAreaCosts& costs,
                              base::Box<D>& bounds, std::uint32_t& size) {
  if (v < boxes.size()) {
    bounds = boxes[v];
    size = 1;
    return {costs.intersection * area(bounds)};
  }
  base::Box<D> other;
  std::uint32_t other_size = 0;
  const auto [a, b] = rows[v - boxes.size()];
  const auto first = all_costs(rows, boxes, a, leaf_size, costs, bounds, size);
  const auto second = all_costs(rows, boxes, b, leaf_size, costs, other, other_size);
  size += other_size;
  for (std::size_t d = 0; d < D; ++d) {
    bounds.min[d] = std::min(bounds.min[d], other.min[d]);
    bounds.max[d] = std::max(bounds.max[d], other.max[d]);
  }
  std::vector<double> all;
  if (size <= leaf_size) all.push_back(costs.intersection * area(bounds) * size);
  for (const double x : first) {
    for (const double y : second) all.push_back(costs.traversal * area(bounds) + x + y);
  }
  return all;
}

template <std::size_t D>
void test_random(std::uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed << " dimension " << D);
  std::mt19937_64 random(seed);
  const std::size_t n = seed == 1 ? 0 : 1 + random() % (seed < 30 ? 9 : 300);
  const auto boxes = random_boxes<D>(n, static_cast<double>(seed % 3), random);
  const auto rows = seed % 5 == 0 ? oracles::chain_tree(n) : oracles::random_tree(n, random);
  HierarchyOptions options;
  options.leaf_size = static_cast<std::uint32_t>(1 + random() % 5);
  options.costs = {0.5 + uniform(random), uniform(random)};
  const BoundingVolumeHierarchy<D> tree(rows, boxes, options);
  expect_sound(tree, boxes, options.leaf_size);
  if (n == 0 || n > 9) return;
  base::Box<D> bounds;
  std::uint32_t size = 0;
  const auto all = all_costs(rows, boxes, static_cast<std::uint32_t>(n + rows.size() - 1),
                             options.leaf_size, options.costs, bounds, size);
  const double root = area(bounds);
  if (root == 0.0) return;
  EXPECT_NEAR(tree.surface_area_cost(options.costs) * root,
              *std::min_element(all.begin(), all.end()), 1e-5 * root);
}

TEST(BoundingVolumeHierarchy, IsValidAndOfLeastCostForItsTree) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    test_random<2>(seed);
    test_random<3>(seed);
  }
}

TEST(BoundingVolumeHierarchy, ComputesTheSurfaceAreaCost) {
  std::vector<base::Box3> cubes;
  for (int k = 0; k < 4; ++k) {
    const auto x = static_cast<double>(k);
    cubes.push_back({{x, 0.0, 0.0}, {x + 1.0, 1.0, 1.0}});
  }
  const std::vector<TreeChildren> rows{{0, 1}, {2, 3}, {4, 5}};
  HierarchyOptions options;
  options.leaf_size = 1;
  const BoundingVolumeHierarchy<3> tree(rows, cubes, options);
  // Areas: 18 for the root, 10 for each node below it, and 6 for each cube.
  EXPECT_NEAR(tree.surface_area_cost(), (18.0 + 2 * 10.0 + 4 * 6.0) / 18.0, 1e-5);
  EXPECT_NEAR(tree.surface_area_cost({2.0, 0.5}), (2 * (18.0 + 2 * 10.0) + 0.5 * 24.0) / 18.0,
              1e-5);
  // With leaf_size 4 the whole tree may be one leaf. It is, if a step costs 10.
  options.leaf_size = 4;
  options.costs.traversal = 10.0;
  const BoundingVolumeHierarchy<3> flat(rows, cubes, options);
  EXPECT_EQ(flat.nodes().size(), 1u);
  EXPECT_NEAR(flat.surface_area_cost(), 4.0, 1e-5);
  // If all areas are 0, every node counts in full.
  const std::vector<base::Box3> equal(4, base::Box3{{1, 2, 3}, {1, 2, 3}});
  options.leaf_size = 1;
  EXPECT_EQ(BoundingVolumeHierarchy<3>(rows, equal, options).surface_area_cost(), 7.0);
}

TEST(BoundingVolumeHierarchy, HandlesDeepTreesAndAnyScale) {
  std::mt19937_64 random(3);
  const auto plain = random_boxes<3>(20000, 0.01, random);
  const auto rows = oracles::chain_tree(plain.size());
  HierarchyOptions options;
  options.leaf_size = 1;
  const BoundingVolumeHierarchy<3> tree(rows, plain, options);
  EXPECT_EQ(tree.depth(), plain.size() - 1);
  expect_sound(tree, plain, 1);
  for (const double unit : {1e300, 1e-300, 1e30, 1e-30, 1e-320}) {
    SCOPED_TRACE(testing::Message() << "unit " << unit);
    auto boxes = random_boxes<3>(100, 0.1, random);
    for (base::Box3& box : boxes) {
      for (std::size_t d = 0; d < 3; ++d) {
        box.min[d] *= unit;
        box.max[d] *= unit;
      }
    }
    const BoundingVolumeHierarchy<3> scaled(oracles::random_tree(100, random), boxes);
    expect_sound(scaled, boxes, 8);
    EXPECT_GT(scaled.surface_area_cost(), 1.0);
  }
  // Georeferenced boxes are small compared to their coordinates.
  auto far = random_boxes<3>(100, 0.001, random);
  for (base::Box3& box : far) {
    for (auto* corner : {&box.min, &box.max}) {
      (*corner)[0] += 500000.0;
      (*corner)[1] += 4600000.0;
    }
  }
  const BoundingVolumeHierarchy<3> map(oracles::random_tree(100, random), far, options);
  expect_sound(map, far, 1);
  for (const auto& node : map.nodes()) {
    if (node.count == 1) {
      EXPECT_LT(node.max[1] - node.min[1], 0.0011f);
    }
  }
}

template <std::size_t D>
void test_rotation(std::uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed << " dimension " << D);
  std::mt19937_64 random(seed);
  const std::size_t n = seed <= 6 ? seed - 1 : 50 + random() % 300;
  auto boxes = random_boxes<D>(n, 0.1, random);
  const double unit = seed % 4 == 0 ? 1e300 : seed % 4 == 1 ? 1e-300 : 1.0;
  for (base::Box<D>& box : boxes) {
    for (std::size_t d = 0; d < D; ++d) {
      box.min[d] *= unit;
      box.max[d] *= unit;
    }
  }
  const auto rows = seed % 3 == 0 ? oracles::chain_tree(n) : oracles::random_tree(n, random);
  HierarchyOptions options;
  options.leaf_size = 1;
  const BoundingVolumeHierarchy<D> before(rows, boxes, options);
  double cost = before.surface_area_cost();
  for (const unsigned passes : {0u, 1u, 3u, 100u}) {
    const auto rotated = rotate_tree<D>(rows, boxes, passes);
    const BoundingVolumeHierarchy<D> after(rotated, boxes, options);
    expect_sound(after, boxes, 1);
    EXPECT_LE(after.surface_area_cost(), cost * (1.0 + 1e-5));
    cost = after.surface_area_cost();
    const auto pairs_of = [&](const std::vector<TreeChildren>& all) {
      std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
      for (const auto& [a, b] : all) {
        if (a < n && b < n) pairs.push_back(std::minmax(a, b));
      }
      std::sort(pairs.begin(), pairs.end());
      return pairs;
    };
    const auto old_pairs = pairs_of(rows), pairs = pairs_of(rotated);
    EXPECT_TRUE(std::includes(pairs.begin(), pairs.end(), old_pairs.begin(), old_pairs.end()));
  }
  if (n > 6) {
    EXPECT_LT(cost, 0.8 * before.surface_area_cost());
  }
}

TEST(BoundingVolumeHierarchy, RotationsLowerTheCost) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    test_rotation<2>(seed);
    test_rotation<3>(seed);
  }
  const std::vector<base::Box3> boxes(3, base::Box3{{0, 0, 0}, {0, 0, 0}});
  const std::vector<TreeChildren> bad{{0, 1}, {2, 4}};
  EXPECT_THROW((void)rotate_tree<3>(bad, boxes), std::invalid_argument);
}

template <class Make>
void expect_refused(Make&& make, const std::string& what) {
  try {
    (void)make();
    ADD_FAILURE() << "accepted, not refused: " << what;
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
  }
}

TEST(BoundingVolumeHierarchy, RefusesBadInput) {
  std::vector<base::Box2> boxes(3, base::Box2{{0, 0}, {0, 0}});
  std::vector<TreeChildren> rows{{0, 1}, {2, 3}};
  HierarchyOptions options;
  const auto make = [&] { return BoundingVolumeHierarchy<2>(rows, boxes, options); };
  EXPECT_EQ(make().order().size(), 3u);
  rows[1] = {2, 4};
  expect_refused(make, "row 1 names node 4, which is not made");
  rows[1] = {0, 3};
  expect_refused(make, "row 1 names node 0, which already has a parent");
  rows[1] = {2, 2};
  expect_refused(make, "row 1 names node 2, which already has a parent");
  rows[0] = {0, 3};
  expect_refused(make, "row 0 names node 3, which is not made");
  rows = {{0, 1}};
  expect_refused(make, "1 rows for 3 primitives");
  rows = {{0, 1}, {2, 3}};
  boxes[2].max[1] = std::numeric_limits<double>::infinity();
  expect_refused(make, "primitive 2");
  boxes[2].max[1] = std::numeric_limits<double>::quiet_NaN();
  expect_refused(make, "primitive 2");
  boxes[2].max[1] = -1.0;
  expect_refused(make, "primitive 2");
  boxes[2].max[1] = 0.0;
  options.leaf_size = 0;
  expect_refused(make, "leaf_size");
  options.leaf_size = 1;
  options.costs.traversal = -1.0;
  expect_refused(make, "costs");
  expect_refused(
      [] {
        return BoundingVolumeHierarchy<2>({}, std::vector<base::Box2>{})
            .surface_area_cost({std::numeric_limits<double>::quiet_NaN(), 1.0});
      },
      "costs");
}

}  // namespace
}  // namespace terrace::matching
