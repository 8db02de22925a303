// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrace/cluster/facility.hpp"

/// Lower bounds: what no solution can cost less than, so that a result can state its gap.
///
/// All of them are values of the Lagrangian dual. Let every client i pay v_i for being connected;
/// a facility is then worth opening if the clients that it connects for less pay for it, and
///     L(v) = sum_i v_i + sum_j min(0, opening_j - sum_i max(0, v_i - c_ij))
/// is not above the cost of any solution, *whatever the v are*. So rounding in the search for good
/// v does no harm; only the evaluation matters, and from that a bound on its rounding errors is
/// taken off: (terms + 8) epsilon times the sum of the absolute values.
/// Sources: D. Erlenkotter, A dual-based procedure for uncapacitated facility location, Operations
/// Research 1978; G. Cornuejols, M. Fisher, G. Nemhauser, Location of bank accounts to optimize
/// float, Management Science 1977; J. Skála, Algorithms for manipulating large geometric data,
/// 4.2.3 (the dual program 4.17 to 4.21).

namespace terrace::cluster {

struct DualBound {
  std::vector<double> duals;  ///< v, per client
  /// L(v) rounded down; not negative.
  double lower_bound = 0.0;
};

/// L(v), rounded down so that no solution costs less; 0 where that would be negative.
/// O(facilities * clients). Throws: std::invalid_argument as check() does, if there is not one dual
/// per client, or one is not finite, naming it.
[[nodiscard]] double dual_value(const FacilityMatrix& problem, std::span<const double> duals);

/// Dual ascent with dual adjustment: raises one v after the other from cost to cost as far as the
/// facilities' opening costs allow, then lowers those that pay for two facilities at once to make
/// room for others. `adjustments`: rounds of the latter, at most; it ends when a round gains
/// nothing. The duals are feasible: no facility is paid more than it costs, up to rounding.
/// Memory 12 bytes per entry of the matrix. Throws: std::invalid_argument as check() does, or if
/// the memory is not to be had, saying how much it is.
[[nodiscard]] DualBound dual_ascent(const FacilityMatrix& problem, std::uint32_t adjustments = 20);

/// Called after each step with those done and to do at most. False ends the search: the bound so
/// far is the result.
using BoundProgress = std::function<bool(std::uint32_t done, std::uint32_t total)>;

struct LowerBoundOptions {
  std::uint32_t iterations = 1000;  ///< subgradient steps; 0: only what they would start from
  unsigned threads = 1;             ///< 0: one per core. Never changes the result.
  BoundProgress progress = {};
};

/// Dual ascent, then subgradient steps on L. `start` is a solution, whose cost is what the steps
/// aim at (the better, the sooner the bound is good); without facilities: a greedy one is made.
/// The limit of the bound is the value of the linear relaxation.
/// Throws: as dual_ascent().
[[nodiscard]] DualBound lower_bound(const FacilityMatrix& problem,
                                    const FacilitySolution& start = {},
                                    const LowerBoundOptions& options = {});

/// The same for points, from a solution of them: its clusters pay for their own facilities to begin
/// with. Nothing is stored per pair of points. Where distances to a box can be bounded (all metrics
/// but the caller's own) a facility looks at the clients near it alone: some hundreds per step,
/// a million points take about a second a step on one core. Otherwise O(points^2) per step.
/// Weights, channels and the price of leaving a client out count. The bound holds for the distances
/// as computed from the given coordinates; what bringing them into range rounds is taken off too.
/// Throws: std::invalid_argument as check() does, on a start that is no solution of the problem,
/// and on a custom distance that is negative or not a number.
[[nodiscard]] DualBound lower_bound(const FacilityPoints& problem, const FacilitySolution& start,
                                    const LowerBoundOptions& options = {.iterations = 100});

}  // namespace terrace::cluster
