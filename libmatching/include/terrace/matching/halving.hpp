// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

/// Euclidean matching by halving: the points are repeatedly divided into two halves, which are
/// matched at the least total distance (an assignment). Source: J. Skála, Algorithms for
/// manipulating large geometric data, 7.5.1.
///
/// Neither method is exact; point_matching.hpp is. The first is as published, the second goes one
/// step further.

namespace terrace::matching {

enum class Halving : std::uint8_t {
  /// As published: random halves, the best matching of all iterations. It does not converge: for
  /// 100 uniform points the best of 1,000 iterations is some 30 to 40 % above the optimum.
  monte_carlo,
  /// Puts the two ends of every current pair into different halves, at random. The current matching
  /// remains possible, so no iteration makes it worse. The cost falls fast and ends near the
  /// optimum; an improvement that involves k pairs at once is found with probability 2^(1-k).
  monotone,
};

struct HalvingOptions {
  Halving method = Halving::monotone;
  std::uint64_t iterations = 0;  ///< 0: as many as points
  /// No iteration begins after this many seconds; the result then depends on the machine.
  double seconds = std::numeric_limits<double>::infinity();
  std::uint64_t seed = 1;
  /// Concurrent iterations of monte_carlo; 0: one per core. Does not change the result (except with
  /// `seconds`).
  unsigned threads = 1;
  std::uint64_t memory_limit = 0;  ///< bytes that the matrices may take; 0: no limit
  /// Called by the caller's thread after each iteration (or a few) with the iterations done, their
  /// total, and the least cost so far. False ends the search.
  std::function<bool(std::uint64_t done, std::uint64_t total, double cost)> progress = {};
  base::StopCheck check_stop = {};
};

struct HalvingMatching {
  std::vector<std::uint32_t> mate;    ///< partner of each point; kNobody for the one left over
  double cost = 0.0;                  ///< sum of the distances of all pairs, added by lower index
  std::uint32_t left_over = kNobody;  ///< the point without a partner where n is odd
  std::uint64_t iterations = 0;
  /// The cost after each iteration that lowered it: a convergence curve.
  struct Step {
    std::uint64_t iteration;
    double cost;
  };
  std::vector<Step> steps;
};

/// Distance of two points by index; symmetric, finite, at most 1e300 in magnitude.
using PairDistance = std::function<double(std::uint32_t, std::uint32_t)>;

/// Matches points in the plane (z = 0) or in space by Euclidean distance.
/// Cost: an assignment of n/2 to n/2 per iteration, O(n^3) at worst; a matrix of n^2/4 doubles per
/// thread.
/// Throws: std::invalid_argument for a coordinate that is not finite or beyond 1e150 (its index is
/// named), and if the matrices do not fit into options.memory_limit (the bytes needed are named);
/// std::bad_alloc.
[[nodiscard]] HalvingMatching match_by_halving(std::span<const Point3> points,
                                               const HalvingOptions& options = {});

/// The same for any distance function. Throws: as above; std::invalid_argument for a distance that
/// is not finite, naming the pair.
[[nodiscard]] HalvingMatching match_by_halving(std::size_t count, const PairDistance& distance,
                                               const HalvingOptions& options = {});

}  // namespace terrace::matching
