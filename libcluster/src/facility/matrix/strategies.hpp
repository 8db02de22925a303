// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/facility_location.hpp"

/// The strategies on a matrix, see FacilityStrategy, and the matrix of other problems. Each
/// strategy fills in its part of the report. Requires: check(problem) has passed.

namespace terrace::cluster {

/// Throws: std::invalid_argument if restarts is 0 or `seconds` is NaN.
[[nodiscard]] FacilitySolution interchange(const FacilityMatrix& problem,
                                           const FacilityOptions& options);
/// Throws: std::invalid_argument if memory cannot be allocated.
[[nodiscard]] FacilitySolution jain_vazirani(const FacilityMatrix& problem, FacilityReport& report,
                                             const base::StopCheck& check_stop);
[[nodiscard]] FacilitySolution greedy_stars(const FacilityMatrix& problem, FacilityReport& report,
                                            const base::StopCheck& check_stop);

/// All costs of a problem of points or entities, so that strategies on a matrix can solve it.
struct CostMatrix {
  std::vector<double> opening, connection;

  [[nodiscard]] FacilityMatrix view() const {
    return {opening.size(), opening.size(), opening, connection};
  }
};

/// Returns the costs with each point or entity as both a facility and a client. A client whose
/// connection would cost more than its outlier price pays that price, whatever its facility.
/// Computes O(n^2) distances.
/// Throws: std::invalid_argument if the 8 n^2 bytes exceed `memory_limit` (0: no limit; the message
/// gives the memory needed), or if a cost overflows a double, like check() of a matrix;
/// std::bad_alloc.
[[nodiscard]] CostMatrix cost_matrix(const FacilityPoints& problem, std::uint64_t memory_limit,
                                     const base::StopCheck& check_stop = {});
[[nodiscard]] CostMatrix cost_matrix(const FacilityEntities& problem, std::uint64_t memory_limit,
                                     const base::StopCheck& check_stop = {});

}  // namespace terrace::cluster
