// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <terrace/cluster/facility_location.hpp>

namespace terrace::research {

struct LpRounding {
  cluster::FacilitySolution solution;  ///< with the lower bound of the duals
  double relaxation = 0.0;             ///< value of the linear relaxation
  std::vector<double> fractions;       ///< to which each facility is open in the relaxation
  std::vector<double> duals;           ///< payment of each client in the relaxation
};

/// Solves uncapacitated facility location by rounding the linear relaxation (programs 4.12 to 4.16
/// of the thesis with fractions allowed). In the order of their duals, each client whose fractional
/// facilities are all still free opens the cheapest of them and blocks the rest. On metric costs
/// the solution costs at most 4 times the relaxation, which is its lower bound. For small problems:
/// constraints x <= y are added as they are violated, and 50 by 50 takes hundredths of a second,
/// 100 by 100 tenths. Not thread-safe. Sources: D. Shmoys, É. Tardos, K. Aardal, Approximation
/// algorithms for facility location problems, STOC 1997; F. Chudak, D. Shmoys, Improved
/// approximation algorithms for the uncapacitated facility location problem, SIAM J. Computing 2003
/// (clusters by duals).
///
/// Throws: std::invalid_argument as check() does, and for more than 10^7 pairs of a facility and a
/// client; std::runtime_error if GLPK fails.
[[nodiscard]] LpRounding lp_rounding(const cluster::FacilityMatrix& problem);

}  // namespace terrace::research
