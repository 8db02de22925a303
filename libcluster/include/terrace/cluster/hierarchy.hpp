// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/point.hpp"

/// The streaming cluster hierarchy: one pass over points of any number in constant memory, by
/// divide and conquer over blocks, every level kept. Source: J. Skála, Algorithms for manipulating
/// large geometric data, 4.3, 7.1.2, 7.2.

namespace terrace::cluster {

/// A closed axis-aligned box; min > max when empty.
struct Bounds {
  Point3 min, max;
  friend bool operator==(const Bounds&, const Bounds&) = default;
};

/// A linear map, row-major: ground = map * position. Clustering measures distances on the ground
/// (metres); positions stay as they came.
using GroundMap = std::array<double, 9>;

/// Over all descendants of a cluster down to level 0, representative included.
/// error: never less than the ground distance from the representative to a descendant; exact (the
/// largest distance) at level 0, above it the smaller of what the triangle inequality and the box
/// give.
struct Summary {
  Bounds box;                     ///< of the positions as they came
  double error = 0.0;             ///< ground units
  std::uint64_t descendants = 0;  ///< level-0 points
};

/// A finished block as the sink sees it. Points are numbered within the block. Cluster c has the
/// points order[first[c]] ... order[first[c + 1] - 1], representative among them, in ascending
/// number. children has `level` ordinals per point: the clusters that it heads on levels 0, 1, ...
struct FinishedBlock {
  unsigned level = 0;
  std::uint64_t block = 0;  ///< ordinal of the block on its level
  std::span<const Point3> positions;
  std::span<const std::byte> payload;  ///< HierarchyOptions::payload_size bytes per point
  std::span<const std::uint64_t> children;
  std::span<const std::uint32_t> first;
  std::span<const std::uint32_t> order;
  std::span<const std::uint32_t> representatives;
  std::span<const Summary> summaries;  ///< one per cluster
};

/// Receives the hierarchy. `prepare` is called by several threads at once, as soon as a block is
/// clustered; `commit` by one thread at a time, in the order of blocks within each level, with what
/// prepare returned. Cluster ordinals follow from that order: the first block's clusters are 0, 1,
/// ... An exception from either ends the build and comes out of push() or finish().
class HierarchySink {
 public:
  /// Whatever the sink makes of a block before its turn has come.
  struct Prepared {
    virtual ~Prepared() = default;
  };

  virtual ~HierarchySink() = default;
  virtual std::unique_ptr<Prepared> prepare(const FinishedBlock& block) = 0;
  virtual void commit(unsigned level, std::unique_ptr<Prepared> prepared) = 0;
  /// The points of the top level, once, at the end: one cluster without a representative
  /// (representatives[0] is UINT32_MAX), order = 0, 1, ...
  virtual void root(const FinishedBlock& block) = 0;
};

struct HierarchyOptions {
  std::size_t block_size = 10000;  ///< most points clustered together
  BlockOptions block;
  std::size_t payload_size = 0;  ///< bytes that travel with each point
  unsigned threads = 1;          ///< any number gives the same hierarchy
  /// The ground map for a block with these bounds; empty: the identity. Called from any thread.
  std::function<GroundMap(const Bounds&)> ground;
  SimdPath simd = SimdPath::automatic;
};

struct HierarchyResult {
  std::uint64_t points = 0;
  unsigned top = 0;
  /// Per level: number of points whose highest level is this or above, and of clusters.
  std::vector<std::uint64_t> level_points, level_clusters;
};

/// Builds the hierarchy. Memory: a few blocks per thread and one per level.
class HierarchyBuilder {
 public:
  /// The sink must outlive the builder. Requires block_size >= 2.
  HierarchyBuilder(HierarchyOptions options, HierarchySink& sink);
  /// Stops without finishing: the sink gets no more calls.
  ~HierarchyBuilder();
  HierarchyBuilder(const HierarchyBuilder&) = delete;
  HierarchyBuilder& operator=(const HierarchyBuilder&) = delete;

  /// Appends points. A batch that fits into one block is never torn: if it does not fit into what
  /// is left of the present block, that block is closed first. (So tiles of a raster stay whole.) A
  /// batch larger than a block is cut into blocks.
  /// Throws: std::invalid_argument on a coordinate that is not finite, naming its index in the
  /// batch (the builder is unchanged); what the sink threw.
  void push(std::span<const Point3> positions, std::span<const std::byte> payload = {});

  /// Clusters what is left, from level 0 upward; the top is the first level that fits one block.
  /// Weights go up as counts of level-0 points and are scaled to mean 1 in each block's own copy.
  HierarchyResult finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::cluster
