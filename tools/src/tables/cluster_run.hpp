// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/cluster/block.hpp>
#include <terrace/cluster/dendrogram.hpp>
#include <terrace/cluster/facility_location.hpp>

namespace terrace::tools {

enum class ClusterMethod : std::uint8_t {
  facility,
  primal_dual,
  k_means,
  k_median,
  single,
  complete,
};

/// The request of `terrace cluster`, for points on the ground.
struct ClusterRequest {
  ClusterMethod method = ClusterMethod::facility;
  cluster::FacilityStrategy strategy = cluster::FacilityStrategy::automatic;  ///< of facility
  std::string iterations;  ///< of facility: tenth, log10, log2, a number; empty: by effort
  cluster::Effort effort = cluster::Effort::standard;
  std::size_t batch = 1;  ///< gains judged at once
  std::size_t k = 0;      ///< clusters wanted; 0: not given
  std::optional<double> height;
  std::optional<std::uint32_t> bound_iterations;  ///< of the lower bound; 0: none
  std::size_t restarts = 1;
  bool single_precision = false;  ///< of the matrix of complete linkage
  bool cuda = false;
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;
};

struct ClusterOutcome {
  std::vector<std::uint32_t> representatives;  ///< per cluster: a point
  std::vector<std::uint32_t> labels;           ///< per point: its cluster, or cluster::kOutlier
  /// Where the method minimises a cost; for k-means the connection cost is the sum of squares.
  std::optional<double> opening_cost, connection_cost, outlier_cost, lower_bound;
  std::optional<cluster::Dendrogram> dendrogram;
  std::vector<std::string> notes;  ///< what the user should know
};

/// Called now and then with the share of the work that is done, if known; may throw to stop.
using ClusterProgress = std::function<void(double fraction)>;

/// Clusters points. Throws: UsageError where options do not go together, std::invalid_argument on
/// bad data, std::runtime_error (too little memory, no device), what `progress` throws.
ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress);

}  // namespace terrace::tools
