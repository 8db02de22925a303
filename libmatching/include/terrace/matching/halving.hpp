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
/// Neither method is exact; point_matching.hpp is.

namespace terrace::matching {

enum class Halving : std::uint8_t {
  /// The published method: random halves. The best matching of all iterations is kept. It does not
  /// converge: for 100 uniform points the best of 1,000 iterations is about 30 to 40 % above the
  /// optimum.
  monte_carlo,
  /// Puts the two ends of every current pair into different halves at random. The current matching
  /// remains possible, so the cost never rises. It falls fast and ends near the optimum. An
  /// improvement that involves k pairs at once is found with probability 2^(1-k).
  monotone,
};

struct HalvingOptions {
  Halving method = Halving::monotone;
  std::uint64_t iterations = 0;  ///< 0: one per point
  /// Starts no iteration after this many seconds. The result then depends on the machine's speed.
  double seconds = std::numeric_limits<double>::infinity();
  std::uint64_t seed = 1;
  /// Number of iterations of monte_carlo that run concurrently. 0 means one per core. Does not
  /// change the result unless `seconds` or `progress` ends the search.
  unsigned threads = 1;
  std::uint64_t memory_limit = 0;  ///< limit for the matrices, in bytes. 0 means none
  /// Called on the caller's thread after each iteration (or a few) with the number of iterations
  /// done, their total, and the least cost so far. Returning false ends the search.
  std::function<bool(std::uint64_t done, std::uint64_t total, double cost)> progress = {};
  base::StopCheck check_stop = {};
};

struct HalvingMatching {
  std::vector<std::uint32_t> mate;  ///< partner of each point, or kNone for the one left over
  double cost = 0.0;                ///< sum of the distances of all pairs, added by lower index
  std::uint32_t left_over = kNone;  ///< the point without a partner where n is odd
  std::uint64_t iterations = 0;
  /// The cost after each iteration that lowered it, which makes a convergence curve.
  struct Step {
    std::uint64_t iteration;
    double cost;
  };
  std::vector<Step> steps;
};

/// Distance of two points given by index. Must be symmetric, finite, and at most 1e300 in
/// magnitude.
using PairDistance = std::function<double(std::uint32_t, std::uint32_t)>;

/// Matches points in the plane (z = 0) or in space by Euclidean distance.
/// Throws: std::invalid_argument for a coordinate that is not finite or exceeds 1e150 in magnitude
/// (the message gives its index), and if the matrices do not fit into options.memory_limit (the
/// message gives the memory needed), and std::bad_alloc.
/// Cost: an assignment of n/2 to n/2 per iteration, O(n^3) at worst, and a matrix of n^2/4 doubles
/// per thread.
[[nodiscard]] HalvingMatching match_by_halving(std::span<const Point3> points,
                                               const HalvingOptions& options = {});

/// Matches points by any distance function, as match_by_halving() of points does. Also throws
/// std::invalid_argument for a distance that is not finite or exceeds 1e300 in magnitude. The
/// message names the pair.
[[nodiscard]] HalvingMatching match_by_halving(std::size_t count, const PairDistance& distance,
                                               const HalvingOptions& options = {});

}  // namespace terrace::matching
