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

/// The Euclidean minimum spanning tree of the points of a kd-tree, all of them different.
///
/// Uses Borůvka's method: in each round every component takes its shortest edge to another one. The
/// largest component is skipped, because it would take longest and the others find its edges.
///
/// A point first offers the first neighbour in its list that is in another component. When the list
/// is exhausted, the point has a lower bound of that distance instead. If the bound is below the
/// best edge of its component so far, the point searches the tree, together with other points of
/// its leaf. The search skips nodes that are entirely in the component.
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
    std::uint32_t position[LinkageTree::kLeaf];
    unsigned count = 0;
    void add(std::uint32_t i, const Point3& p) {
      box.include(p);
      position[count++] = i;
    }
  };

  void label_nodes();
  void offer_list_edges(std::size_t begin, std::size_t end);
  void search_tree(std::size_t begin, std::size_t end);
  [[nodiscard]] bool needs_search(std::uint32_t position);
  void search_from(const Group& group, std::uint32_t own);
  void offer(std::uint32_t component, const TreeEdge& edge);
  [[nodiscard]] double limit(std::uint32_t component);
  void merge();

  const LinkageTree& tree_;
  const unsigned threads_;
  const std::uint32_t count_;
  NeighbourLists lists_;
  std::vector<std::uint8_t>
      used_;  ///< by position: number of leading list entries in its component
  std::vector<double>
      bound_;  ///< by position: lower bound of the distance, if its list is exhausted
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
