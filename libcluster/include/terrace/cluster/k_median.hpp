// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/facility_location.hpp"

/// k-median: opens exactly k facilities, which cost nothing, for the least sum of connection costs.
/// As in the original method of stream clustering, a binary search over the facility cost finds a
/// facility location solution with k facilities, and swaps of facilities lead to a local optimum.
/// Sources: L. O'Callaghan, N. Mishra, A. Meyerson, S. Guha, R. Motwani, Streaming-data algorithms
/// for high-quality clustering, ICDE 2002; M. Charikar, S. Guha, Improved combinatorial algorithms
/// for the facility location and k-median problems, FOCS 1999; R. Whitaker, A fast algorithm for
/// the greedy interchange, INFOR 1983.

namespace terrace::cluster {

struct KMedianOptions {
  /// Number of swap searches, including the first, at least 1; the best result is returned. The
  /// first starts from the result of the binary search, each further one from that result with half
  /// of the facilities replaced at random.
  std::uint32_t restarts = 32;
  /// Number of subgradient steps for lower_bound, each O(facilities * clients); 0: no bound.
  std::uint32_t bound_steps = 300;
  std::uint64_t seed = 1;
  unsigned threads = 1;  ///< 0: one per core. Does not change the result.
  base::StopCheck check_stop = {};
};

/// Returns a solution with exactly k facilities, some without clients if necessary. Ignores the
/// opening costs of the problem; in the solution they are 0. No swap of one facility for another
/// improves the solution by more than rounding. If no facility cost of the search gives exactly k
/// facilities, the result with the closest number is corrected greedily: facilities that save most
/// are opened, or facilities that cost least to close are closed. Cost: O(facilities * clients) per
/// round of swaps, a few rounds per search. Throws: std::invalid_argument as check() does, if k is
/// 0 or above the number of facilities, or if restarts is 0.
[[nodiscard]] FacilitySolution k_median(const FacilityMatrix& problem, std::size_t k,
                                        const KMedianOptions& options = {});

/// Solves the same problem for points. Ignores facility_cost. Clients farther than outlier_price
/// diagonals from all facilities are left out and pay that price. A facility always serves itself.
/// Distances are computed as needed, in O(points) memory. A round of swaps computes points^2
/// distances, which takes seconds for 20,000 points. For large sets the binary search considers a
/// random sample of at least 4 k positions.
/// Throws: as k_median() of a matrix, and for a custom distance that is negative or NaN.
[[nodiscard]] FacilitySolution k_median(const FacilityPoints& problem, std::size_t k,
                                        const KMedianOptions& options = {.restarts = 1,
                                                                         .bound_steps = 0});

}  // namespace terrace::cluster
