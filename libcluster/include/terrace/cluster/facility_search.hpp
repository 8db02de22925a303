// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "terrace/cluster/facility.hpp"

/// The general uncapacitated facility location problem by local search with restarts.
/// Sources: J. Skála, Algorithms for manipulating large geometric data, 4.2.3 (the candidate and
/// what is not worth keeping beside it); R. Whitaker, A fast algorithm for the greedy interchange,
/// INFOR 1983 and M. Resende, R. Werneck, A fast swap-based local search procedure for location
/// problems, Annals of Operations Research 2007 (nearest and second nearest open facility).

namespace terrace::cluster {

struct FacilitySearchOptions {
  /// Independent searches, each from an initial solution of its own; at least 1.
  std::uint32_t restarts = 8;
  /// How often each of them disturbs its solution and searches on from there.
  std::uint32_t perturbations = 200;
  std::uint64_t seed = 1;
  unsigned threads = 1;  ///< restarts at once; 0: one per core. Never changes the result.
  /// After so many seconds no further perturbation is begun, so that the result depends on the
  /// machine; infinite, and the result is a function of problem, seed and counts.
  double seconds = std::numeric_limits<double>::infinity();
};

/// The best solution found. It is a local optimum: no opening, closing or exchange of one facility
/// for another improves it (by more than rounding), nor does opening any facility while closing
/// those whose clients are better off there.
/// Cost: O(facilities * clients) per round through the candidates, some rounds per perturbation;
/// memory O(facilities + clients) per thread, and a copy of the matrix if its costs exceed 2^900.
/// Throws: std::invalid_argument as check() does, without restarts, or if `seconds` is NaN.
[[nodiscard]] FacilitySolution facility_search(const FacilityMatrix& problem,
                                               const FacilitySearchOptions& options = {});

}  // namespace terrace::cluster
