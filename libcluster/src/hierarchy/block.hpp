// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hierarchy/entity_block.hpp"
#include "hierarchy/metric_block.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// A block of the hierarchy, from its first point to the sink. Private to the hierarchy.

namespace terrace::cluster {

/// The points of a block and, after processing, its clusters. Blocks are recycled and keep their
/// memory.
struct HierarchyBlock {
  unsigned level = 0;
  std::uint64_t number = 0;
  std::uint64_t outliers = 0;
  std::vector<Point3> positions;
  std::vector<std::byte> payload;
  std::vector<std::uint64_t> children;  ///< `level` ordinals per point
  std::vector<ClusterSummary>
      heads;  ///< above level 0, per point: summary of the cluster one level below

  BlockClustering clustering;
  std::vector<std::uint32_t> first, order;  ///< as in ClusteredBlock
  std::vector<ClusterSummary> summaries;
  std::unique_ptr<HierarchySink::Prepared> prepared;

  [[nodiscard]] std::size_t size() const { return positions.size(); }

  /// Empties the block for reuse.
  void reset(unsigned new_level);
  /// Appends the representative of cluster c of a processed block one level below, whose ordinal is
  /// now known.
  void append_representative(const HierarchyBlock& below, std::size_t c, std::uint64_t ordinal,
                             std::size_t payload_size);
  [[nodiscard]] ClusteredBlock finished() const;
};

/// Clusters a block by Euclidean distances: BlockClusterer::run, or a stand-in in tests.
using ClusterFunction = std::function<void(std::span<const Point3>, std::span<const double>,
                                           const BlockOptions&, BlockClustering&)>;

/// Returns the seed of one block. It is a fixed mixture, so blocks may be clustered in any order.
std::uint64_t block_seed(std::uint64_t seed, unsigned level, std::uint64_t block);

/// Clusters blocks and computes their summaries. One object per thread.
class BlockProcessor {
 public:
  /// The options must outlive the processor.
  BlockProcessor(const HierarchyOptions& options, ClusterFunction cluster);

  /// Fills in clustering, first, order and summaries. At most half of the points, rounded up,
  /// become representatives; otherwise the hierarchy might never end. If the facility cost is too
  /// low for that, it is raised for this block.
  /// Throws: std::invalid_argument as check_ground_map() does.
  void process(HierarchyBlock& block);

 private:
  void cluster(HierarchyBlock& block, std::span<const Point3> ground);
  void read_channels(const HierarchyBlock& block);
  /// Fills corners_ with the corners of all entities, on the ground.
  void read_corners(const HierarchyBlock& block, const Point3& origin, const GroundMap& map);
  [[nodiscard]] double outlier_price(const HierarchyBlock& block) const;
  void place_outliers(HierarchyBlock& block, std::span<const Point3> ground);

  const HierarchyOptions& options_;
  ClusterFunction cluster_;
  Metric metric_;                                       // of the current block
  std::optional<MetricBlockClusterer> metric_cluster_;  // unless BlockClusterer does everything
  EntityBlockClusterer entity_cluster_;                 // if points have further corners
  std::vector<Point3> ground_, corners_;
  std::vector<double> weights_, channels_;
};

}  // namespace terrace::cluster
