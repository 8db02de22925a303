// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {

/// Assigns points to kOutlier where that lowers the cost of a clustering that ignores
/// problem.outlier_price.
///
/// Members farther from their facility than the price become outliers. A cluster is dissolved if it
/// costs more than its members would cost elsewhere. Each of its members then goes to the nearest
/// remaining facility, or becomes an outlier if that costs more than the price. `facilities` keeps
/// the facilities of dissolved clusters, and at least one cluster remains.
///
/// Requires a metric that is linear on the bounding box of the points, and neither weights nor
/// channels. Does nothing if the price is infinite. Takes O(n) time, plus O(k) for each member of a
/// cluster that may be dissolved.
void assign_outliers(const FacilityPoints& problem, BlockClustering& clustering);

/// Clusters the blocks of a hierarchy under any metric, with channels and outliers. Uses
/// BlockClusterer if that is possible and no other strategy is requested, otherwise solve(). One
/// object per thread.
class MetricBlockClusterer {
 public:
  explicit MetricBlockClusterer(SimdPath path) : clusterer_(path) {}

  /// Clusters the points of a problem, which are on the ground. The costs of the problem are
  /// multiples of the diagonal of the points that are not outliers. Outliers are assigned to
  /// kOutlier. The costs in `result` are unspecified. Requires that weights are empty if there is
  /// an outlier price. Throws: std::invalid_argument as solve() does.
  void run(const FacilityPoints& problem, const FacilityOptions& options, BlockClustering& result);

 private:
  void run_once(const FacilityPoints& problem, const FacilityOptions& options,
                BlockClustering& result);

  BlockClusterer clusterer_;
  std::vector<Point3> points_;  // the points that are not outliers
  std::vector<double> channels_;
  std::vector<std::uint32_t> numbers_;  // for each of points_, its number in the block
};

/// Clusters the blocks of a hierarchy whose points represent entities of several corners. One
/// object per thread.
class EntityBlockClusterer {
 public:
  /// Clusters entities.
  /// corners: in ground coordinates, `count` consecutive ones for each entity.
  /// ordered: as in PayloadCorners.
  /// channels: further axes of the distance, in ground units.
  /// weights: one per entity.
  /// facility_cost: a multiple of the diagonal of the bounding box of all corners, with channels as
  /// further axes.
  /// The automatic strategy searches small blocks with at least Effort::fine. Sets the costs in
  /// `result` to 0.
  /// Throws: std::invalid_argument as solve(FacilityEntities) does.
  void run(std::span<const Point3> corners, std::size_t count, bool ordered,
           const Channels& channels, std::span<const double> weights, double facility_cost,
           const FacilityOptions& options, BlockClustering& result);

 private:
  /// Returns the diagonal of the scaled corners and channels.
  double scale(std::span<const Point3> corners, const Channels& channels, std::size_t entities);

  std::vector<Point3> scaled_;
  std::vector<double> scaled_channels_;
};

}  // namespace terrace::cluster
