// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terrace/cluster/facility.hpp"

/// Facility location by rounding the linear relaxation (the thesis's program 4.12 to 4.16 with
/// fractions allowed). The relaxation is solved by GLPK, whose licence is GPL-3.0-or-later: the
/// library has this only if it was configured with -Dterrace_glpk=enabled, and is then bound by
/// that licence.
/// Sources: D. Shmoys, É. Tardos, K. Aardal, Approximation algorithms for facility location
/// problems, STOC 1997; F. Chudak, D. Shmoys, Improved approximation algorithms for the
/// uncapacitated facility location problem, SIAM J. Computing 2003 (clusters by duals); J. Skála,
/// Algorithms for manipulating large geometric data, 4.2.3.

namespace terrace::cluster {

struct LpRounding {
  FacilitySolution solution;      ///< with lower_bound, which is that of `duals`, rounded down
  double relaxation = 0.0;        ///< value of the linear program, as solved; below any solution
  std::vector<double> fractions;  ///< how far each facility is open in it
  std::vector<double> duals;      ///< what each client pays in it
};

/// Whether the library was built with GLPK.
[[nodiscard]] bool has_lp_rounding();

/// Clients in the order of their duals: each whose fractional facilities are all free yet opens the
/// cheapest of them and blocks the rest. On metric costs the solution costs at most 4 times the
/// relaxation. For small problems: constraints x <= y are added as they are violated; 50 by 50 take
/// hundredths of a second, 100 by 100 tenths. Not from several threads at once.
/// Throws: std::invalid_argument as check() does; std::runtime_error if the library was built
/// without GLPK, naming the option, or if GLPK fails.
[[nodiscard]] LpRounding lp_rounding(const FacilityMatrix& problem);

}  // namespace terrace::cluster
