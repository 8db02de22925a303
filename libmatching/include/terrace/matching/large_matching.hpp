// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrace/matching/point.hpp"
#include "terrace/matching/point_matching.hpp"

namespace terrace::matching {

struct LargeMatchingOptions {
  /// Up to so many points are matched exactly, as by match_points(), unless there are labels.
  std::size_t exact_limit = 500'000;
  /// The cluster of each point, any numbers: each cluster is matched first, then what was left over
  /// in clusters of odd size. Empty: the set is cut into compact parts instead.
  std::span<const std::uint32_t> labels{};
  std::size_t window = 50'000;  ///< most points in a window; at least 4
  /// Most rounds of windows after the first matching; 0 leaves it as the clusters or parts gave it.
  unsigned rounds = 8;
  /// Windows agree where a round makes the cost less by no more than this share.
  double tolerance = 1e-3;
  PointMetric metric{};  ///< Euclidean where `distance` is empty; called from several threads
  unsigned threads = 1;  ///< 0: one per core. Never changes the result.
  /// Called by the caller's thread between windows with those matched so far, those that there will
  /// be if all rounds are needed, and the cost once there is a matching (before, 0). False ends the
  /// rounds with the matching that stands; before there is one it has no effect.
  std::function<bool(std::uint64_t done, std::uint64_t total, double cost)> progress = {};
};

struct LargeMatching {
  std::vector<std::uint32_t> mate;    ///< partner of each point, kNobody for the one left over
  double cost = 0.0;                  ///< sum of the distances of all pairs
  double dual_bound = 0.0;            ///< no matching costs less, but for rounding
  std::uint32_t left_over = kNobody;  ///< the point without partner where n is odd
  bool optimal = false;               ///< matched all at once: the optimum, but for rounding
  unsigned rounds = 0;                ///< of windows; 0 where matched exactly
  std::uint64_t windows = 0;          ///< matched in all rounds, the clusters or parts too

  /// At most so much of the cost, as a share of the bound, is above the optimum.
  [[nodiscard]] double gap() const;
};

/// Matching of point sets of any size: the optimum up to a limit, beyond it within a proven gap.
///
/// points: in the plane or in space, finite; equal ones allowed. Of an odd number one is left over.
///
/// Method: compact parts (or the caller's clusters) are matched exactly, each for itself, in
/// parallel. Then come rounds of windows: the pairs are cut into compact sets along other lines,
/// and each set is matched anew. The present pairs of a window are one of its matchings, so that
/// the cost never rises; a pair that suffered from the border of a part lies inside a window of the
/// next round. Rounds end where windows agree with the matching that they found.
///
/// Guarantee: dual_bound. The duals of the last windows (those that took part: discs and moats
/// around the points) are lowered until no pair from different windows is nearer than they allow;
/// half their sum bounds every matching from below.
///
/// Returns: the same for the same input and options, whatever the threads.
/// Throws: std::invalid_argument as match_points(), and for labels of another number than points, a
/// window below 4, a tolerance that is negative or no number.
/// Cost: O(n log n) for cutting and the bound, and in each round n / window exact matchings; about
/// 130 bytes per point and 1 kB per point of the windows at work (one per thread).
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.5.1 (clusters first, then
/// within them); the windows and the bound are ours. Duals as discs and moats: M. Jünger and W.
/// Pulleyblank, "Geometric duality and combinatorial optimization", 1993.
LargeMatching match_large(std::span<const Point2> points, const LargeMatchingOptions& options = {});
LargeMatching match_large(std::span<const Point3> points, const LargeMatchingOptions& options = {});

}  // namespace terrace::matching
