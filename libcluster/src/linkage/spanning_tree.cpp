// SPDX-License-Identifier: Apache-2.0
#include "linkage/spanning_tree.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "linkage/points.hpp"

namespace terrace::cluster {
namespace {

constexpr std::uint32_t kMixed = 0xffffffffu;
constexpr std::size_t kPointsPerBlock = 2048;
constexpr std::size_t kLeavesPerBlock = 256;

}  // namespace

SpanningTree::SpanningTree(const LinkageTree& tree, unsigned threads,
                           const base::StopCheck& check_stop)
    : tree_(tree),
      threads_(threads),
      count_(static_cast<std::uint32_t>(tree.size())),
      lists_(tree, threads, check_stop),
      used_(count_, 0),
      bound_(count_, 0.0),
      component_(count_),
      label_(tree.nodes()),
      shortest_(count_),
      roots_(count_),
      largest_(kMixed),
      sets_(count_) {
  edges_.reserve(count_ - 1);
  for (std::uint32_t i = 0; i < count_; ++i) {
    component_[i] = roots_[i] = i;
    if (lists_.length() > 0) {
      bound_[i] =
          squared_distance(tree_.point(i), tree_.point(lists_.list(i)[lists_.length() - 1]));
    }
  }
  while (roots_.size() > 1) {
    for (const std::uint32_t root : roots_)
      shortest_[root] = {std::numeric_limits<double>::infinity(), kMixed, kMixed};
    base::parallel_blocks(count_, kPointsPerBlock, threads_,
                          [&](std::size_t begin, std::size_t end, unsigned) {
                            if (check_stop) check_stop();
                            offer_list_edges(begin, end);
                          });
    label_nodes();
    base::parallel_blocks(tree_.leaves(), kLeavesPerBlock, threads_,
                          [&](std::size_t begin, std::size_t end, unsigned) {
                            if (check_stop) check_stop();
                            search_tree(begin, end);
                          });
    merge();
  }
}

double SpanningTree::limit(std::uint32_t component) {
  return std::atomic_ref(shortest_[component].square).load(std::memory_order_relaxed);
}

void SpanningTree::offer(std::uint32_t component, const TreeEdge& edge) {
  if (edge.square > limit(component)) return;
  locks_.lock(component);
  TreeEdge& shortest = shortest_[component];
  if (edge < shortest) {
    shortest.low = edge.low;
    shortest.high = edge.high;
    std::atomic_ref(shortest.square).store(edge.square, std::memory_order_relaxed);
  }
  locks_.unlock(component);
}

void SpanningTree::offer_list_edges(std::size_t begin, std::size_t end) {
  const unsigned length = lists_.length();
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t own = component_[i];
    if (own == largest_) continue;
    const std::uint32_t* const list = lists_.list(i);
    unsigned used = used_[i];
    while (used < length && component_[list[used]] == own) ++used;
    used_[i] = static_cast<std::uint8_t>(used);
    if (used == length) continue;
    const double square = squared_distance(tree_.point(i), tree_.point(list[used]));
    offer(own, TreeEdge::of(square, static_cast<std::uint32_t>(i), list[used]));
  }
}

void SpanningTree::label_nodes() {
  base::parallel_blocks(tree_.leaves(), kPointsPerBlock, threads_,
                        [this](std::size_t first, std::size_t last, unsigned) {
                          for (std::size_t leaf = first; leaf < last; ++leaf) {
                            const std::size_t begin = tree_.leaf_begin(leaf);
                            const std::size_t end = tree_.leaf_begin(leaf + 1);
                            std::uint32_t label = component_[begin];
                            for (std::size_t i = begin + 1; i < end; ++i) {
                              if (component_[i] != label) label = kMixed;
                            }
                            label_[tree_.leaf_node(leaf)] = label;
                          }
                        });
  for (std::size_t node = tree_.leaves(); node-- > 1;) {
    const std::uint32_t label = label_[2 * node];
    label_[node] = label == label_[2 * node + 1] ? label : kMixed;
  }
}

void SpanningTree::search_tree(std::size_t begin, std::size_t end) {
  for (std::size_t leaf = begin; leaf < end; ++leaf) {
    const auto first = static_cast<std::uint32_t>(tree_.leaf_begin(leaf));
    const auto last = static_cast<std::uint32_t>(tree_.leaf_begin(leaf + 1));
    unsigned searching = 0;
    for (std::uint32_t i = first; i < last; ++i) {
      searching |= static_cast<unsigned>(needs_search(i)) << (i - first);
    }
    while (searching != 0) {
      // Points of one component search together.
      const std::uint32_t own =
          component_[first + static_cast<unsigned>(std::countr_zero(searching))];
      Group group;
      for (std::uint32_t i = first; i < last; ++i) {
        const unsigned bit = 1u << (i - first);
        if ((searching & bit) == 0 || component_[i] != own) continue;
        group.add(i, tree_.point(i));
        searching &= ~bit;
      }
      search_from(group, own);
    }
  }
}

bool SpanningTree::needs_search(std::uint32_t position) {
  const std::uint32_t own = component_[position];
  return own != largest_ && used_[position] == lists_.length() && bound_[position] <= limit(own);
}

/// Finds the shortest edge from the group to other components, unless it is longer than an edge
/// that its own component has already found.
void SpanningTree::search_from(const Group& group, std::uint32_t own) {
  TreeEdge best{limit(own), kMixed, kMixed};
  std::uint32_t best_position = kMixed;
  struct PendingNode {
    double square;
    std::size_t node;
  };
  PendingNode stack[64];
  unsigned pending = 0;
  stack[pending++] = {0.0, 1};
  while (pending > 0) {
    const PendingNode top = stack[--pending];
    if (top.square > best.square) continue;
    if (!tree_.is_leaf(top.node)) {
      PendingNode near{group.box.squared_distance(tree_.box(2 * top.node)), 2 * top.node};
      PendingNode far{group.box.squared_distance(tree_.box(2 * top.node + 1)), 2 * top.node + 1};
      if (far.square < near.square) std::swap(near, far);
      if (far.square <= best.square && label_[far.node] != own) stack[pending++] = far;
      if (near.square <= best.square && label_[near.node] != own) stack[pending++] = near;
      continue;
    }
    const std::size_t leaf = top.node - tree_.leaves();
    const auto end = static_cast<std::uint32_t>(tree_.leaf_begin(leaf + 1));
    for (unsigned q = 0; q < group.count; ++q) {
      const Point3 p = tree_.point(group.position[q]);
      if (tree_.box(top.node).squared_distance(p) > best.square) continue;
      for (auto j = static_cast<std::uint32_t>(tree_.leaf_begin(leaf)); j < end; ++j) {
        if (component_[j] == own) continue;
        const TreeEdge edge =
            TreeEdge::of(squared_distance(p, tree_.point(j)), group.position[q], j);
        if (edge < best) {
          best = edge;
          best_position = group.position[q];
        }
      }
    }
  }
  for (unsigned q = 0; q < group.count; ++q) {
    double& bound = bound_[group.position[q]];
    bound = std::max(bound, best.square);
  }
  if (best_position == kMixed) return;
  offer(own, best);
  // The nearest point of another component replaces the last entry of the list.
  const unsigned last = lists_.length() - 1;
  lists_.list(best_position)[last] = best.low == best_position ? best.high : best.low;
  used_[best_position] = static_cast<std::uint8_t>(last);
}

void SpanningTree::merge() {
  for (const std::uint32_t root : roots_) {
    const TreeEdge& edge = shortest_[root];
    // Two components may have chosen each other. The first of the two unites them.
    if (root != largest_ && sets_.unite(edge.low, edge.high)) edges_.push_back(edge);
  }
  for (const std::uint32_t root : roots_) sets_.flatten(root);
  base::parallel_blocks(count_, kPointsPerBlock, threads_,
                        [this](std::size_t begin, std::size_t end, unsigned) {
                          for (std::size_t i = begin; i < end; ++i)
                            component_[i] = sets_.flat(component_[i]);
                        });
  std::vector<std::uint32_t> size(count_, 0);
  for (const std::uint32_t component : component_) ++size[component];
  std::size_t count = 0;
  largest_ = roots_.front();
  for (const std::uint32_t root : roots_) {
    if (size[root] == 0) continue;
    roots_[count++] = root;
    if (size[root] > size[largest_]) largest_ = root;
  }
  roots_.resize(count);
}

}  // namespace terrace::cluster
