// SPDX-License-Identifier: Apache-2.0
#include "facility/points/client_tree.hpp"

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "search_laws.hpp"

namespace terrace::cluster {
namespace {

constexpr ClientTree::Kind kKinds[] = {ClientTree::Kind::quadtree, ClientTree::Kind::octree,
                                       ClientTree::Kind::kd_tree};

// Checks every node: its box and connection are those of its clients, which its children partition.
void expect_tree(const ClientTree& tree, const std::vector<Point3>& points,
                 const std::vector<double>& connections) {
  const auto& nodes = tree.nodes();
  ASSERT_EQ(nodes[0].count, points.size());
  ASSERT_EQ(std::set<std::uint32_t>(tree.order().begin(), tree.order().end()).size(),
            points.size());
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    const ClientTree::Node& node = nodes[n];
    std::vector<Point3> inside;
    double longest = 0.0;
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      inside.push_back(points[tree.order()[k]]);
      longest = std::max(longest, connections[tree.order()[k]]);
    }
    ASSERT_EQ(base::box_of(inside), node.box) << n;
    ASSERT_EQ(longest, node.longest) << n;
    std::uint32_t count = 0;
    for (std::uint32_t c = node.first_child; c < node.first_child + node.child_count; ++c) {
      ASSERT_EQ(nodes[c].parent, n);
      ASSERT_EQ(nodes[c].first, node.first + count);
      count += nodes[c].count;
    }
    if (node.child_count > 0) {
      ASSERT_EQ(count, node.count);
      ASSERT_GT(node.child_count, 1u);
    }
  }
}

TEST(ClientTree, StaysConsistentWhileConnectionsChange) {
  for (laws::OwnedProblem& p : laws::problems(500, 41)) {
    if (p.name == "collinear") {
      double size = 1.0;
      for (Point3& q : p.points) q = {size *= 0.5, 0.0, size};  // halves down to denormal numbers
    }
    for (const ClientTree::Kind kind : kKinds) {
      SCOPED_TRACE(p.name + ", kind " + std::to_string(static_cast<int>(kind)));
      std::mt19937_64 random(42);
      ClientTree tree(kind, p.points);
      std::vector<double> connections(p.points.size());
      for (double& c : connections) c = inputs::uniform(random);
      tree.set(connections);
      ASSERT_NO_FATAL_FAILURE(expect_tree(tree, p.points, connections));
      for (int round = 0; round < 20; ++round) {
        std::vector<std::uint32_t> changed;
        for (int k = 0; k < 1 + round; ++k) {
          const auto i = static_cast<std::uint32_t>(random() % p.points.size());
          changed.push_back(i);
          connections[i] = round % 3 == 0 ? 0.0 : inputs::uniform(random);
        }
        tree.update(changed, connections);
        ASSERT_NO_FATAL_FAILURE(expect_tree(tree, p.points, connections));
      }
    }
  }
}

TEST(ClientTree, LeavesAreSmallWherePointsDiffer) {
  std::mt19937_64 random(43);
  const std::vector<Point3> points = inputs::cube(5000, random);
  for (const ClientTree::Kind kind : kKinds) {
    const ClientTree tree(kind, points);
    EXPECT_GT(tree.nodes().size(), 5000u / 16);
    for (const ClientTree::Node& node : tree.nodes()) {
      if (node.child_count == 0) {
        EXPECT_LE(node.count, 16u);
      }
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
