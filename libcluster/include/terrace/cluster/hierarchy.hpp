// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include <terrace/base/cluster.hpp>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/metric.hpp"
#include "terrace/cluster/point.hpp"

/// The streaming cluster hierarchy: one pass over any number of points in constant memory, by
/// divide and conquer over blocks, with every level kept.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.3, 7.1.2, 7.2. Differences
/// from the thesis:
/// - blocks are clustered in parallel;
/// - distances are ground distances, under any metric;
/// - a level that fits one block becomes the top without being clustered;
/// - a facility cost that is too low to reduce a block is raised;
/// - k-median is an option, not the only result (see HierarchyOptions::medians).
///
/// Points arrive at level 0. Each block of a level is clustered separately. The representative of
/// each cluster, an input point, moves up to the level above, where it heads that cluster. So every
/// input point ends in exactly one place: as a member, not a representative, of a cluster on the
/// highest level that it reached, or as a point of the root.

namespace terrace::cluster {

/// A linear map, row-major: ground = map * position. Clustering measures distances on the ground
/// (metres), but positions are stored unchanged. Entries must be finite and not all zero. A map may
/// be singular: a row of zeros excludes that direction from all distances.
using GroundMap = LinearMap;

using base::ClusteredBlock;
/// The box is that of the unmapped positions. At level 0 the error is the largest ground distance,
/// rounded up; above, it is the smaller of the bounds from the triangle inequality and from the
/// box. Distances use the map of the block. Distances within the levels below, which the triangle
/// inequality adds up, use the maps of the blocks there.
using base::ClusterSummary;
using base::kNoRepresentative;

/// Receives the hierarchy. Several threads call `prepare` at once, as soon as a block is clustered.
/// Its points have HierarchyOptions::payload_size bytes of payload, and those of a cluster are in
/// ascending order. Its spans are valid until the call returns.
/// One thread at a time calls `commit` with what prepare returned, in the order of blocks within
/// each level. Cluster ordinals follow that order: the first block's clusters are 0, 1, ... The
/// commits of different levels have no fixed order relative to each other. An exception from either
/// ends the build. push() or finish() throws it once, when no call to the sink is running any more.
class HierarchySink {
 public:
  /// The result of prepare(), kept until the block is committed.
  struct Prepared {
    virtual ~Prepared() = default;
  };

  virtual ~HierarchySink() = default;
  virtual std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) = 0;
  virtual void commit(unsigned level, std::unique_ptr<Prepared> prepared) = 0;
  /// Receives the points of the top level once, at the end, from finish(), as one cluster without a
  /// representative: representatives[0] is kNoRepresentative, the error is 0, and order is 0, 1,
  /// ... Without input the cluster has no points and an empty box.
  virtual void root(const ClusteredBlock& block) = 0;
};

/// Attributes (colour, intensity) in the payload of a point that become further axes of distances.
struct PayloadChannels {
  std::vector<double> weights;  ///< ground units per unit of each channel; not negative, finite
  /// Reads the channels of one point, one per weight. May be called on any thread.
  std::function<void(std::span<const std::byte> payload, std::span<double> values)> read;
};

/// Entities of several corners (segments, triangles, polylines of k vertices) instead of points.
/// The position of a "point" is its first corner, and its payload holds the others. Distances are
/// those of facility_location.hpp, on the ground. (thesis chapter 9)
struct PayloadCorners {
  std::size_t count = 1;  ///< corners per entity, including the position; 1: points
  /// True for polylines: corners keep their order or its reverse. Otherwise every correspondence of
  /// corners is allowed, and there are at most three corners.
  bool ordered = false;
  /// Writes the `count` corners of one entity. The first is already filled in. May be called on any
  /// thread.
  std::function<void(std::span<const std::byte> payload, std::span<Point3> corners)> read;
};

struct HierarchyOptions {
  std::size_t block_size = 10000;  ///< maximum number of points clustered together; 2 to 2^24 - 1
  /// k-median over the stream: the top consists of this many points, the medians, whose clusters
  /// are those of the level below. If there are no more points than that, all of them are the top.
  /// 0: the top is the first level that fits one block.
  ///
  /// The first level that fits one block is clustered by k_median(), with the counts of level-0
  /// points as weights. To keep that level fine, each block chooses its facility cost so that at
  /// least 25 representatives per median of a full block remain, but no more than a quarter of the
  /// points need to (fewer remain if points coincide). The facility cost of `block` is not used.
  /// With a block_size of 100 medians or more, the cost of connecting all points to their nearest
  /// medians is usually 1 to 2 % above that of k_median() of all points in memory. The last step
  /// takes O(block_size^2) time per round of swaps. Must be below block_size; without corners and
  /// outliers.
  /// Source: L. O'Callaghan et al., Streaming-data algorithms for high-quality clustering, ICDE
  /// 2002 (thesis 4.3, 7.1).
  std::size_t medians = 0;
  /// Each block has its own seed, mixed from this seed, its level and its ordinal. At most half of
  /// a block's points, rounded up, become representatives; otherwise the levels might never end. If
  /// the facility cost is too low for that, it is raised for that block.
  BlockOptions block;
  /// Distances on the ground, after `ground` is applied. The boxes of a field are in that frame.
  /// ClusterSummary::error remains a Euclidean ground distance.
  Metric metric = Euclidean{};
  /// How blocks are clustered. `automatic` uses BlockClusterer if the metric is linear in the
  /// bounding box of the block (Euclidean, elliptical, or a field with one region there) and there
  /// are no channels. Otherwise it uses the local search that solve() of facility_location.hpp
  /// chooses. Any other value: solve() with that strategy. A local search is ten to a hundred times
  /// slower. Its effort is that of `block`, but with `automatic` at least Effort::fine in blocks of
  /// fewer than 2500 points. Clusters are in the order of their representatives.
  FacilityStrategy strategy = FacilityStrategy::automatic;
  /// As in FacilityOptions: threads that work on one block, and candidates evaluated at once.
  unsigned search_threads = 1;
  std::size_t batch = 1;
  /// The cost of leaving out a point of level 0, as a multiple of the diagonal like the facility
  /// cost. In blocks of n < block_size points (the last one, tiles) it is multiplied by
  /// sqrt(block_size / n). If infinite, no point is left out. Outliers are found and removed until
  /// there are none, with the diagonal of the remaining points, so they affect neither positions
  /// nor sizes of clusters. Each outlier then becomes a member of the cluster with the nearest
  /// representative, whose box, error and count include it, and `mark_outlier` is called on its
  /// payload. Representatives are ordinary points: nothing is left out above level 0. (thesis
  /// 7.1.3, figure 7.3)
  double outlier_price = std::numeric_limits<double>::infinity();
  std::function<void(std::span<std::byte> payload)> mark_outlier;  ///< may be called on any thread
  /// Returns the metric for a block with these bounds, and overrides `metric`. A field needs it if
  /// `ground`, and thus the frame of the boxes, depends on the block. May be called on any thread.
  std::function<Metric(const Box3&)> metric_of;
  PayloadChannels channels;  ///< empty: position only
  /// With more than one corner, blocks are clustered by the local search for entities (strategies
  /// automatic, full_scan, facilities), and the facility cost is a multiple of the diagonal of the
  /// bounding box of all corners. Channels are further axes: the distance is the root of the sum of
  /// the squared distance of the corners and the squared differences of the channels. The metric
  /// must be Euclidean, without outliers.
  /// Summaries cover only the positions, so the sink must keep the bounds of the other corners
  /// itself.
  PayloadCorners corners;
  std::size_t payload_size = 0;  ///< bytes that travel with each point
  /// The number of clusters that each level, from 0, has already: new clusters are numbered from
  /// there. Levels beyond the list have none. See HierarchyBuilder::push_heads().
  std::vector<std::uint64_t> existing_clusters;
  /// Number of working threads, including the caller's, which clusters blocks instead of waiting.
  /// Does not change the hierarchy. With 1 (or 0) everything runs on the caller's thread.
  unsigned threads = 1;
  /// Returns the ground map for a block with these bounds. If empty, the identity. May be called on
  /// any thread.
  std::function<GroundMap(const Box3&)> ground;
  SimdPath simd = SimdPath::automatic;
  /// After a stop request, the local search of a block ends with the best result so far. For work
  /// that is abandoned and whose sink then throws.
  std::stop_token stop;
  /// Called once when the work has failed, on the thread in which it failed. For an owner who waits
  /// for input and would see the exception only at the next push(). Must neither throw nor call the
  /// builder.
  std::function<void()> on_failure;
};

/// Points above level 0 with the existing clusters that they head.
struct ClusterHeads {
  unsigned level = 0;  ///< of the points; at least 1
  std::span<const Point3> positions;
  std::span<const std::byte> payload;         ///< HierarchyOptions::payload_size bytes per point
  std::span<const std::uint64_t> children;    ///< `level` ordinals per point, level 0 first
  std::span<const ClusterSummary> summaries;  ///< of the cluster of level - 1 that each point heads
};

struct HierarchyResult {
  /// Points passed to push().
  std::uint64_t points = 0;
  unsigned top = 0;
  /// For each level from 0 to the top: the number of points whose highest level is this one or
  /// above, and the number of clusters. The root counts as one cluster. Points of existing
  /// hierarchies count only on the levels where they were passed, and those above.
  std::vector<std::uint64_t> level_points, level_clusters;
  std::uint64_t outliers = 0;
};

/// Builds the hierarchy in the memory of a few blocks per thread and one per level. The result
/// depends only on the input, the seed and the options other than threads and simd.
class HierarchyBuilder {
 public:
  /// The sink must outlive the builder.
  /// Throws: std::invalid_argument
  /// - if block_size, facility_cost, outlier_price, the metric, a channel's weight or the number of
  ///   corners is out of range;
  /// - if channels, corners or outliers have no function;
  /// - if corners are combined with another metric or outliers;
  /// - if there are medians and corners or outliers, or as many medians as a block has points;
  /// - if the SIMD path is not available.
  HierarchyBuilder(HierarchyOptions options, HierarchySink& sink);
  /// Stops without finishing. Waits for the blocks that are being clustered, after which the sink
  /// gets no more calls.
  ~HierarchyBuilder();
  HierarchyBuilder(const HierarchyBuilder&) = delete;
  HierarchyBuilder& operator=(const HierarchyBuilder&) = delete;

  /// Appends points. A batch that fits into one block is never split: if it does not fit into the
  /// rest of the current block, that block is closed first, so raster tiles stay whole. A larger
  /// batch is treated as a stream, which fills the current block and is cut wherever a block is
  /// full. An empty batch only reports failures.
  /// Throws: std::invalid_argument for a coordinate that is not finite (the message gives its index
  /// in the batch), and for a payload whose size is not payload_size bytes per point. The builder
  /// is then unchanged. After the following exceptions the builder has ended, and further calls
  /// throw std::logic_error:
  /// - whatever the sink or `ground` throws;
  /// - std::invalid_argument for a ground map that is not finite, is zero, or makes distances
  /// beyond
  ///   1e150; for a channel or corner that is not finite; for a custom distance that is negative or
  ///   not finite; and for a strategy that a block does not admit.
  void push(std::span<const Point3> positions, std::span<const std::byte> payload = {});

  /// Joins existing hierarchies: appends the points of their top levels, each on its own level,
  /// where they are clustered with the other points of that level. So many hierarchies become one
  /// in the time that their tops take. The new top is on the same level as the highest of theirs,
  /// or above. The options' `existing_clusters` are those of all joined hierarchies below their
  /// tops, and children are numbered among them. Waits for the blocks before, so joins are cheap
  /// only in few calls. Throws: as push(); std::invalid_argument for sizes that do not match.
  void push_heads(const ClusterHeads& heads);

  /// Clusters the remaining points, from level 0 upward. The top is the first level that fits one
  /// block. Weights go up as counts of level-0 points and are scaled to mean 1 in each block's
  /// copy.
  /// Throws: as push(). May be called once.
  HierarchyResult finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the cluster of each point, for clusters of about `size` points by facility location.
/// Clusters are numbered from 0 without gaps, and are the same for any number of threads.
///
/// The hierarchy is built in memory, and the level is taken whose mean cluster size is nearest to
/// `size` (as a ratio). Blocks are compact sets of points, whatever the order of the input. The
/// facility cost gives clusters of about 100 points, so smaller sizes give these too, and up to
/// 10,000 points form one cluster. Takes O(n log n). progress, if given, is called with the number
/// of points done; an exception from it or from check_stop ends
/// the work.
/// Throws: std::invalid_argument unless size is positive; as HierarchyBuilder::push().
[[nodiscard]] std::vector<std::uint32_t> clusters_of_size(
    std::span<const Point3> points, double size, std::uint64_t seed, unsigned threads = 1,
    const std::function<void(std::uint64_t)>& progress = {},
    const base::StopCheck& check_stop = {});

}  // namespace terrace::cluster
