// SPDX-License-Identifier: Apache-2.0
#include "linkage/neighbour_lists.hpp"

#include <algorithm>
#include <limits>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

constexpr std::size_t kLeavesPerListBlock = 64;

/// The best edges found so far for one point, in ascending order.
struct Best {
  TreeEdge edge[NeighbourLists::kMaxLength];
  unsigned length;

  void clear(unsigned entries) {
    length = entries;
    const double infinity = std::numeric_limits<double>::infinity();
    for (TreeEdge& e : edge) e = {infinity, 0, 0};
  }
  [[nodiscard]] double reach() const { return edge[length - 1].square; }
  void insert(const TreeEdge& e) {
    unsigned k = length - 1;
    if (!(e < edge[k])) return;
    for (; k > 0 && e < edge[k - 1]; --k) edge[k] = edge[k - 1];
    edge[k] = e;
  }
};

}  // namespace

NeighbourLists::NeighbourLists(const LinkageTree& tree, unsigned threads,
                               const base::StopCheck& check_stop)
    : length_(static_cast<unsigned>(
          std::min<std::size_t>(NeighbourLists::kMaxLength, tree.size() - 1))),
      lists_(tree.size() * length_) {
  if (length_ == 0) return;
  base::parallel_blocks(tree.leaves(), kLeavesPerListBlock, threads,
                        [&](std::size_t begin, std::size_t end, unsigned) {
                          if (check_stop) check_stop();
                          for (std::size_t leaf = begin; leaf < end; ++leaf) search(tree, leaf);
                        });
}

/// All points of a leaf search together, because they mostly need the same nodes.
void NeighbourLists::search(const LinkageTree& tree, std::size_t leaf) {
  const std::size_t first = tree.leaf_begin(leaf);
  const std::size_t count = tree.leaf_begin(leaf + 1) - first;
  const std::size_t own = tree.leaf_node(leaf);
  const Box3& box = tree.box(own);
  Best best[LinkageTree::kLeaf];
  for (std::size_t q = 0; q < count; ++q) best[q].clear(length_);
  double reach = std::numeric_limits<double>::infinity();

  const auto visit = [&](std::size_t node) {
    const std::size_t begin = tree.leaf_begin(node - tree.leaves());
    const std::size_t size = tree.leaf_begin(node - tree.leaves() + 1) - begin;
    const double* const x = tree.axis(0) + begin;
    const double* const y = tree.axis(1) + begin;
    const double* const z = tree.axis(2) + begin;
    reach = 0.0;
    for (std::size_t q = 0; q < count; ++q) {
      const Point3 p = tree.point(first + q);
      const double limit = best[q].reach();
      if (tree.box(node).squared_distance(p) <= limit) {
        double square[LinkageTree::kLeaf];
        unsigned close = 0;
        for (std::size_t k = 0; k < LinkageTree::kLeaf; ++k) {
          const double dx = p[0] - x[k];
          const double dy = p[1] - y[k];
          const double dz = p[2] - z[k];
          square[k] = dx * dx + dy * dy + dz * dz;
        }
        for (unsigned k = 0; k < LinkageTree::kLeaf; ++k) {
          close |= static_cast<unsigned>(square[k] <= limit) << k;
        }
        close &= (1u << size) - 1;
        if (node == own) close &= ~(1u << q);
        for (; close != 0; close &= close - 1) {
          const auto k = static_cast<std::size_t>(__builtin_ctz(close));
          best[q].insert(TreeEdge::of(square[k], static_cast<std::uint32_t>(first + q),
                                      static_cast<std::uint32_t>(begin + k)));
        }
      }
      reach = std::max(reach, best[q].reach());
    }
  };

  visit(own);
  struct PendingNode {
    double square;
    std::size_t node;
  };
  PendingNode stack[128];
  unsigned pending = 0;
  stack[pending++] = {0.0, 1};
  while (pending > 0) {
    const PendingNode top = stack[--pending];
    // Ties are not skipped: among several neighbours at one distance the positions decide.
    if (top.square > reach || top.node == own) continue;
    if (tree.is_leaf(top.node)) {
      visit(top.node);
      continue;
    }
    PendingNode near{box.squared_distance(tree.box(2 * top.node)), 2 * top.node};
    PendingNode far{box.squared_distance(tree.box(2 * top.node + 1)), 2 * top.node + 1};
    if (far.square < near.square) std::swap(near, far);
    if (far.square <= reach) stack[pending++] = far;
    if (near.square <= reach) stack[pending++] = near;
  }

  for (std::size_t q = 0; q < count; ++q) {
    const auto position = static_cast<std::uint32_t>(first + q);
    for (unsigned k = 0; k < length_; ++k) {
      const TreeEdge& e = best[q].edge[k];
      list(position)[k] = e.low == position ? e.high : e.low;
    }
  }
}

}  // namespace terrace::cluster
