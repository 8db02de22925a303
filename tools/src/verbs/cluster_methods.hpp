// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <terrace/cluster/block.hpp>
#include <terrace/cluster/dendrogram.hpp>
#include <terrace/cluster/facility_location.hpp>
#include <terrace/cluster/linkage.hpp>

/// The methods of `terrace cluster`, each by one algorithm of libcluster.

namespace terrace::tools {

enum class ClusterMethod : std::uint8_t {
  facility,
  primal_dual,
  k_means,
  k_median,
  linkage,
};

/// The request of `terrace cluster`, for points on the ground.
struct ClusterRequest {
  ClusterMethod method = ClusterMethod::facility;
  cluster::LinkageMethod linkage = cluster::LinkageMethod::single;
  std::string linkage_name;  ///< as the user wrote it
  cluster::FacilityStrategy strategy = cluster::FacilityStrategy::automatic;  ///< of facility
  std::string iterations;  ///< of facility: tenth, log10, log2 or a number; empty: by effort
  cluster::Effort effort = cluster::Effort::standard;
  std::size_t batch = 1;         ///< candidates evaluated at once
  std::size_t k = 0;             ///< requested number of clusters; 0: not requested
  std::optional<double> height;  ///< height at which linkage cuts the tree
  std::optional<std::uint32_t> bound_iterations;  ///< steps for the lower bound; 0: no bound
  std::size_t restarts = 1;                       ///< runs of k-means and k-median
  bool single_precision = false;                  ///< holds the linkage matrix as floats
  bool cuda = false;
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;
};

struct ClusterOutcome {
  std::vector<std::uint32_t> representatives;  ///< per cluster: index of a point
  std::vector<std::uint32_t> labels;           ///< per point: its cluster, or cluster::kOutlier
  /// Set if the method minimises a cost. For k-means the connection cost is the sum of squares.
  std::optional<double> opening_cost, connection_cost, outlier_cost, lower_bound;
  std::optional<cluster::Dendrogram> dendrogram;
  std::vector<std::string> notes;  ///< shown to the user
};

/// Called from time to time with the completed share of the work; may throw to stop.
using ClusterProgress = std::function<void(double fraction)>;

/// Clusters points. Throws UsageError if options contradict each other, std::invalid_argument for
/// invalid data, std::runtime_error if there is too little memory or no device, and what `progress`
/// throws.
ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress);

}  // namespace terrace::tools
