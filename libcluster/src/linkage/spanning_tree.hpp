// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/union_find.hpp>

#include "linkage/neighbour_lists.hpp"
#include "linkage/tree.hpp"

/// Private to single linkage.

namespace terrace::cluster {

/// The Euclidean minimum spanning tree of the points of a kD-tree, all of them different.
///
/// Uses Borůvka's method: in each round every component except the largest takes its shortest edge
/// to another one. A point's candidate is the first neighbour in its list that is in another
/// component. When its list is exhausted, the point has a bound instead. It searches the tree only
/// if that bound is below the best edge that its component has found so far, together with other
/// points of its leaf. The search skips nodes that are entirely in the component. The largest
/// component does not search, as that would take longest; the others find its edges.
class SpanningTree {
 public:
  SpanningTree(const LinkageTree& tree, unsigned threads, const base::StopCheck& check_stop);
  [[nodiscard]] const std::vector<TreeEdge>& edges() const { return edges_; }

 private:
  /// A few locks shared by all components.
  class Locks {
   public:
    void lock(std::uint32_t key) {
      while (flags_[key % kCount].test_and_set(std::memory_order_acquire)) {
        std::this_thread::yield();  // the holder of the lock may be waiting for a processor
      }
    }
    void unlock(std::uint32_t key) { flags_[key % kCount].clear(std::memory_order_release); }

   private:
    static constexpr std::size_t kCount = 1024;
    std::array<std::atomic_flag, kCount> flags_{};
  };

  /// Points of one leaf and one component, with their box.
  struct Group {
    Box3 box;
    std::uint32_t place[LinkageTree::kLeaf];
    unsigned count = 0;
    void add(std::uint32_t i, const Point3& p) {
      box.include(p);
      place[count++] = i;
    }
  };

  void label_nodes();
  void take_from_lists(std::size_t begin, std::size_t end);
  void search_tree(std::size_t begin, std::size_t end);
  [[nodiscard]] bool must_search(std::uint32_t place);
  void search_from(const Group& group, std::uint32_t own);
  void offer(std::uint32_t component, const TreeEdge& edge);
  [[nodiscard]] double limit(std::uint32_t component);
  void merge();

  const LinkageTree& tree_;
  const unsigned threads_;
  const std::uint32_t count_;
  NeighbourLists lists_;
  std::vector<std::uint8_t> used_;  ///< number of leading list entries in the own component
  std::vector<double> bound_;       ///< after the list is exhausted: no other component is nearer
  std::vector<std::uint32_t> component_;  ///< by position: the lowest position of its component
  std::vector<std::uint32_t> label_;      ///< by node: its component, or kMixed
  std::vector<TreeEdge> shortest_;        ///< by a component's lowest position: its best edge
  Locks locks_;                           ///< protect shortest_, which several threads update
  std::vector<std::uint32_t> roots_;      ///< the components
  std::uint32_t largest_ = 0;             ///< the largest component; kMixed at first
  base::UnionFind sets_;
  std::vector<TreeEdge> edges_;
};

}  // namespace terrace::cluster
