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

/// Facility location on one block of points: chooses representatives (facilities) among the points
/// and assigns every point to one, at low total cost
///     Q = k * fc + sum of weight(i) * distance(i, facility of i)
/// where k is the number of facilities and fc, the facility cost, is a multiple of the diagonal of
/// the block's bounding box.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3, 7.1, 7.3. Differences
/// from the thesis: the start (equal distances along a space-filling curve instead of Meyerson's),
/// candidates along that curve instead of random ones, facilities moved to the median of their
/// clients, and a final exact assignment. The thesis's own search is in facility_location.hpp.

namespace terrace::cluster {

struct BlockOptions {
  double facility_cost = 1.0;  ///< positive; multiplied by the diagonal of the bounding box
  Effort effort = Effort::standard;
  std::uint64_t seed = 1;  ///< only Effort::full tries random candidates
  /// Called only during large blocks. If it throws, the clusterer can still be used for the next
  /// block.
  base::StopCheck check_stop = {};
};

/// A clustering. Clusters are numbered along a space-filling curve, so clusters with close numbers
/// are close to each other. The facility of a cluster is assigned to itself.
///
/// Every point is assigned to the nearest facility, as computed in single precision in the unit of
/// the block's bounding box. So another facility may be nearer by at most a millionth of the
/// diagonal. On ties, including duplicate points, the lowest cluster number wins.
struct BlockClustering {
  std::vector<std::uint32_t> facilities;  ///< per cluster: the point that is its facility
  std::vector<std::uint32_t> assignment;  ///< per point: its cluster
  double facility_cost = 0.0;             ///< the absolute facility cost, in the unit of the points
  double connection_cost = 0.0;           ///< sum of weighted distances, in double precision

  [[nodiscard]] double cost() const {
    return static_cast<double>(facilities.size()) * facility_cost + connection_cost;
  }
};

/// The SIMD code path. All paths give the same bytes.
using base::best_simd_path;
using base::SimdPath;

/// Clusters blocks one after another and reuses its memory. Use one object per thread. The result
/// depends only on the points, their order, the weights and the options. It does not depend on the
/// machine, the number of threads, or previous blocks.
class BlockClusterer {
 public:
  /// Throws: std::invalid_argument if `path` is not available on this machine.
  explicit BlockClusterer(SimdPath path = SimdPath::automatic);
  ~BlockClusterer();
  BlockClusterer(BlockClusterer&&) noexcept;
  BlockClusterer& operator=(BlockClusterer&&) noexcept;

  /// Clusters n points.
  /// points: positions in one Cartesian frame, finite, of any offset and scale. Duplicates and
  /// degenerate blocks are allowed; if all points are equal there is one facility.
  /// weights: n positive finite numbers, which multiply distances, or empty for 1 each.
  /// Requires: n < 2^24. Without points the result is empty.
  ///
  /// Blocks of fewer than 2500 points always get Effort::full, because a reduced search is up to
  /// 30 % worse there (thesis table 7.5). Costs that overflow a double are infinite, but the
  /// clustering is correct even then.
  /// Cost: 0.05 to 0.1 us per point for blocks of 10,000 points at standard effort with AVX-512,
  /// and O(n k) for large n. Needs about 140 bytes of memory per point, which it keeps for the next
  /// block.
  void run(std::span<const Point3> points, std::span<const double> weights,
           const BlockOptions& options, BlockClustering& result);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::cluster
