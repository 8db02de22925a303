// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "hierarchy/block.hpp"
#include "hierarchy/block_pipeline.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// The implementation of HierarchyBuilder. Private to the hierarchy.

namespace terrace::cluster {

/// Cuts points into blocks, passes blocks through a pipeline, and collects the representatives of
/// each level in the next one.
class HierarchyEngine {
 public:
  /// Calls make_cluster once per thread of the options. Tests pass a different clustering.
  HierarchyEngine(HierarchyOptions options, HierarchySink& sink,
                  const std::function<ClusterFunction()>& make_cluster);

  /// See HierarchyBuilder.
  void push(std::span<const Point3> positions, std::span<const std::byte> payload);
  void push_heads(const ClusterHeads& heads);
  HierarchyResult finish();

 private:
  using BlockPtr = BlockPipeline::BlockPtr;

  // A level is a stream of points cut into blocks. `open` is the block for the next point. It is
  // submitted only when a point arrives that does not fit, so that a level of a single block
  // becomes the root.
  struct Level {
    unsigned level = 0;
    BlockPtr open;
    std::uint64_t points = 0;
    std::uint64_t blocks = 0;    // blocks submitted
    std::uint64_t clusters = 0;  // clusters committed, and those that existed before
  };

  void append(std::span<const Point3> positions, std::span<const std::byte> payload);
  Level& level_at(unsigned number);
  void submit(Level& level);
  void process(HierarchyBlock& block, unsigned thread);
  void commit(HierarchyBlock& block);
  void deliver_root(Level& level);
  void check_open();

  const HierarchyOptions options_;
  HierarchySink& sink_;
  std::vector<BlockProcessor> processors_;  // one per thread
  // Level 0 belongs to the caller of push(), except for `clusters`. That and the higher levels
  // belong to the committing thread. This is a deque, so that adding a level does not move `base_`.
  std::deque<Level> levels_;
  Level& base_;
  unsigned lowest_top_ = 0;     // the top is at least this level
  std::uint64_t outliers_ = 0;  // outliers in committed blocks
  bool ended_ = false;
  BlockPipeline pipeline_;  // last, because its threads use all members above
};

}  // namespace terrace::cluster
