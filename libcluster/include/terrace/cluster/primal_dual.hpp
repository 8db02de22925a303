// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terrace/cluster/facility.hpp"

/// Facility location by primal-dual growth: time passes, every client that is not connected yet
/// offers as much as the time, for its connection and, what is left of it, for opening; a facility
/// that is offered its opening cost opens. Deterministic: at equal times the lower number is first.
/// In both, clients go to the cheapest open facility at the end, and facilities that are left
/// without clients close. Where costs obey the triangle inequality, the solutions cost at most a
/// constant times the optimum.

namespace terrace::cluster {

struct PrimalDual {
  FacilitySolution solution;  ///< with lower_bound
  std::vector<double> duals;  ///< when each client was connected
  /// The bound is made of the duals divided by this: the least divisor (to 1e-9) for which no
  /// facility is paid more than it costs. 1 for Jain and Vazirani.
  double divisor = 1.0;
};

/// The algorithm of Jain and Vazirani: offers stand after a client is connected; of facilities
/// that share a client who paid for both, only the first to have opened stays open. The duals are
/// feasible; on metric costs the solution costs at most 3 times their sum.
/// O(facilities * clients * log(facilities * clients)), 12 bytes per entry of the matrix.
/// Source: K. Jain, V. Vazirani, Approximation algorithms for metric facility location and k-median
/// problems using the primal-dual schema and Lagrangian relaxation, J. ACM 2001.
/// Throws: as dual_ascent().
[[nodiscard]] PrimalDual jain_vazirani(const FacilityMatrix& problem);

/// The algorithm of Mahdian, Markakis, Saberi and Vazirani, which the thesis describes: a client
/// withdraws its other offers when it is connected. So the duals sum to the cost before the
/// clients change over, and are feasible only after division: by at most 1.861 on metric costs, by
/// at most the harmonic number of the clients on any.
/// O(facilities * clients * log(clients)) and more with many ties, 4 bytes per entry of the matrix.
/// Sources: M. Mahdian et al., A greedy facility location algorithm analyzed using dual fitting,
/// APPROX 2001; J. Skála, Algorithms for manipulating large geometric data, 4.2.3.
/// Throws: as dual_ascent().
[[nodiscard]] PrimalDual greedy_stars(const FacilityMatrix& problem);

}  // namespace terrace::cluster
