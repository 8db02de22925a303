// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <terrace/base/simd.hpp>
#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/effort.hpp"
#include "terrace/cluster/point.hpp"

/// Facility location on one block of points: choose representatives (facilities) among the points
/// and assign every point to one, at low total cost
///     Q = k * fc + sum of weight(i) * distance(i, facility of i)
/// where k is the number of facilities and fc, the facility cost, a multiple of the diagonal of the
/// block's bounding box.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3, 7.1, 7.3. It differs
/// from that in: the start (equal distances along a space-filling curve instead of Meyerson's),
/// candidates along that curve instead of random ones, facilities moved to the median of their
/// clients, an exact last assignment. The thesis's own search is in facility_location.hpp.

namespace terrace::cluster {

struct BlockOptions {
  double facility_cost = 1.0;  ///< positive; multiplied by the diagonal of the bounding box
  Effort effort = Effort::standard;
  std::uint64_t seed = 1;  ///< only Effort::full tries random candidates
  /// For large blocks. After it has thrown, the next block is clustered as if nothing had happened.
  base::StopCheck check_stop = {};
};

/// Facilities in the order of their cluster numbers, which is that of a space-filling curve:
/// clusters with close numbers are close to each other. assignment[i] is the cluster number of
/// point i; the facility of a cluster is assigned to itself.
/// Every point is assigned to the nearest facility (a weight multiplies all its distances alike),
/// as computed in single precision in the unit of the block's bounding box: another facility may be
/// nearer by at most a millionth of the diagonal. On ties, duplicates included, the lowest number
/// wins.
struct BlockClustering {
  std::vector<std::uint32_t> facilities;
  std::vector<std::uint32_t> assignment;
  double facility_cost = 0.0;    ///< the absolute facility cost, in the unit of the points
  double connection_cost = 0.0;  ///< sum of weighted distances, in double precision

  [[nodiscard]] double cost() const {
    return static_cast<double>(facilities.size()) * facility_cost + connection_cost;
  }
};

/// The instruction sets among which a caller may choose; all give the same bytes.
using base::best_simd_path;
using base::SimdPath;

/// Clusters blocks one after another, keeping its memory in between. One object per thread. The
/// result depends only on the points, their order, the weights and the options: not on the machine,
/// on threads, or on previous blocks.
class BlockClusterer {
 public:
  /// Throws: std::invalid_argument if `path` is not available on this machine.
  explicit BlockClusterer(SimdPath path = SimdPath::automatic);
  ~BlockClusterer();
  BlockClusterer(BlockClusterer&&) noexcept;
  BlockClusterer& operator=(BlockClusterer&&) noexcept;

  /// points: n positions in one Cartesian frame, finite, any offset and scale; duplicates and
  /// degenerate blocks are ordinary (all points equal: one facility).
  /// weights: n positive finite numbers, or empty for 1 each. They multiply distances.
  /// Blocks of fewer than 2500 points get Effort::full whatever the options (there a reduced search
  /// is up to 30 % worse, thesis table 7.5). Requires n < 2^24. n = 0 gives an empty result.
  /// Costs are infinite if they overflow a double; the clustering is correct even then.
  /// Time: for blocks of 10 000 points at standard effort and with AVX-512, 0.05 to 0.1 us per
  /// point; O(n k) for large n. Memory: about 140 bytes per point, kept for the next block.
  void run(std::span<const Point3> points, std::span<const double> weights,
           const BlockOptions& options, BlockClustering& result);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::cluster
