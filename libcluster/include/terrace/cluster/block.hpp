// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "terrace/cluster/point.hpp"

/// Facility location on one block of points: choose representatives (facilities) among the points
/// and assign every point to one, at low total cost
///     Q = k * fc + sum of weight(i) * distance(i, facility of i)
/// where fc, the facility cost, is a multiple of the diagonal of the block's bounding box.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3, 7.1, 7.3.

namespace terrace::cluster {

/// How long to search. Costs are relative to `full`, on surfaces.
enum class Effort : std::uint8_t {
  fast,      ///< fewer candidates; about 3 % above full
  standard,  ///< one sweep over half of the points; at most 3 % above full
  fine,      ///< two sweeps over all points; about 1 % above full
  full,      ///< the thesis's search: m ceil(log2 m) candidates
};

struct BlockOptions {
  double facility_cost = 1.0;  ///< times the diagonal of the bounding box
  Effort effort = Effort::standard;
  std::uint64_t seed = 1;
};

/// Facilities in the order of their cluster numbers; assignment[i] is the cluster number of point
/// i; the facility of a cluster is assigned to itself.
struct BlockClustering {
  std::vector<std::uint32_t> facilities;
  std::vector<std::uint32_t> assignment;
  double facility_cost = 0.0;    ///< the absolute one, in the unit of the points
  double connection_cost = 0.0;  ///< sum of weighted distances, in double precision

  [[nodiscard]] double cost() const {
    return static_cast<double>(facilities.size()) * facility_cost + connection_cost;
  }
};

/// Which code path runs. Every path gives the same bytes.
enum class SimdPath : std::uint8_t { automatic, portable, avx2, avx512 };

/// Clusters blocks one after another, keeping its memory between them. One object per thread.
/// The result depends on the points, their order, the weights and the options alone: not on the
/// machine, on threads, or on the blocks before.
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
  /// Blocks of fewer than 2500 points get Effort::full whatever the options say (a reduced search
  /// is up to 30 % off there, thesis table 7.5). Requires n < 2^24. n = 0 gives an empty result.
  void run(std::span<const Point3> points, std::span<const double> weights,
           const BlockOptions& options, BlockClustering& result);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The path that `automatic` takes on this machine.
SimdPath best_simd_path();

}  // namespace terrace::cluster
