// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "linkage/cluster_slots.hpp"
#include "linkage/kernels.hpp"
#include "linkage/points.hpp"
#include "terrace/cluster/linkage.hpp"

/// Clusters of points that are represented by one position each. Private to linkage.

namespace terrace::cluster {

/// Clusters for ward, centroid and median linkage, without a matrix. Distances are squared
/// distances of scaled positions.
/// - ward: the position is the mean, and the distance is the growth of the sum of squares.
/// - centroid: the position is the mean.
/// - median: the position is midway between the positions of the two parts.
class ClusterMeans : public ClusterSlots {
 public:
  ClusterMeans(const LinkagePoints& points, LinkageMethod method, const LinkageOptions& options);

  [[nodiscard]] double distance(std::uint32_t a, std::uint32_t b) const;
  [[nodiscard]] NearCluster nearest(std::uint32_t x, std::uint32_t begin, std::uint32_t end,
                                    NearCluster best);
  void join(std::uint32_t low, std::uint32_t high, double between);
  void move(const std::vector<std::uint32_t>& slots);
  [[nodiscard]] double height(double distance) const { return linkage_points_.height(distance); }

 private:
  const LinkagePoints& linkage_points_;
  const LinkageMethod method_;
  const LinkageKernels<double>& kernels_;
  std::vector<double> axis_[3];  ///< infinite for dead slots
  std::vector<double> row_;      ///< scratch memory
};

}  // namespace terrace::cluster
