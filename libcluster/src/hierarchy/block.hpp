// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hierarchy/block_clusterers.hpp"
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
  /// If positive, the number of its clusters: this is the last block before the top.
  std::size_t medians = 0;
  std::vector<Point3> positions;
  std::vector<std::byte> payload;
  std::vector<std::uint64_t> children;  ///< `level` ordinals per point
  /// Above level 0, per point: the summary of the cluster that it heads one level below.
  std::vector<ClusterSummary> heads;

  BlockClustering clustering;
  std::vector<std::uint32_t> first, order;  ///< as in ClusteredBlock
  std::vector<ClusterSummary> summaries;
  std::unique_ptr<HierarchySink::Prepared> prepared;

  [[nodiscard]] std::size_t size() const { return positions.size(); }

  /// Empties the block for reuse.
  void reset(unsigned new_level);
  /// Appends the representative of cluster c of a processed block one level below. ordinal: of the
  /// cluster, on its level.
  void append_representative(const HierarchyBlock& below, std::size_t c, std::uint64_t ordinal,
                             std::size_t payload_size);
  /// Appends a point that heads existing clusters.
  void append_head(const ClusterHeads& from, std::size_t point, std::size_t payload_size);
  /// Returns the processed block as the sink receives it.
  [[nodiscard]] ClusteredBlock finished() const;
};

/// Clusters a block by Euclidean distances. It is BlockClusterer::run, which tests can replace.
using ClusterFunction = std::function<void(std::span<const Point3>, std::span<const double>,
                                           const BlockOptions&, BlockClustering&)>;

/// Returns the seed of one block. It is a fixed mixture, so blocks may be clustered in any order.
std::uint64_t block_seed(std::uint64_t seed, unsigned level, std::uint64_t block);

/// Summarises a cluster of level 0. members: point numbers, including `representative`.
ClusterSummary summarise_points(std::span<const Point3> positions,
                                std::span<const std::uint32_t> members,
                                std::uint32_t representative, const GroundMap& map);

/// Summarises a cluster above level 0. heads[i] is the summary of the cluster one level below that
/// is headed by point i.
ClusterSummary summarise_heads(std::span<const Point3> positions,
                               std::span<const ClusterSummary> heads,
                               std::span<const std::uint32_t> members, std::uint32_t representative,
                               const GroundMap& map);

/// Clusters blocks and computes their summaries. One object per thread.
class BlockProcessor {
 public:
  /// The options must outlive the processor.
  BlockProcessor(const HierarchyOptions& options, ClusterFunction cluster);

  /// Fills in clustering, first, order and summaries. At most half of the points, rounded up,
  /// become representatives, because otherwise the hierarchy might never end. If the facility cost
  /// is too low for that, raises it for this block. With medians, enough become representatives
  /// (see HierarchyOptions::medians), except in the block that states the number of its medians.
  /// Throws: std::invalid_argument as check_ground_map() does.
  void process(HierarchyBlock& block);

 private:
  void cluster(HierarchyBlock& block, std::span<const Point3> ground);
  /// Clusters once at this facility cost.
  void cluster_at(double facility_cost, HierarchyBlock& block, std::span<const Point3> ground);
  void find_medians(HierarchyBlock& block, std::span<const Point3> ground);
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
