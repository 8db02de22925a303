// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/point.hpp"
#include "terrace/matching/point_matching.hpp"

namespace terrace::matching {

struct LargeMatchingOptions {
  /// Up to this many points are matched exactly, as by match_points(), unless labels are given.
  std::size_t exact_limit = 500'000;
  /// The cluster of each point, as arbitrary numbers: each cluster is matched first, then the
  /// points left over in clusters of odd size. Empty: the set is cut into compact parts instead.
  std::span<const std::uint32_t> labels{};
  std::size_t window = 50'000;  ///< most points in a window; at least 4
  /// Maximum number of window rounds after the first matching; 0 keeps the matching of the clusters
  /// or parts.
  unsigned rounds = 8;
  /// Rounds end when one lowers the cost by no more than this share.
  double tolerance = 1e-3;
  PointMetric metric{};  ///< Euclidean where `distance` is empty; called from several threads
  unsigned threads = 1;  ///< 0: one per core. Never changes the result.
  /// Called by the caller's thread between windows with the number matched so far, the number if
  /// all rounds are needed, and the cost once there is a matching (0 before). False ends the rounds
  /// and keeps the current matching; before there is one it has no effect.
  std::function<bool(std::uint64_t done, std::uint64_t total, double cost)> progress = {};
  base::StopCheck check_stop = {};
};

struct LargeMatching {
  std::vector<std::uint32_t> mate;    ///< partner of each point, kNobody for the one left over
  double cost = 0.0;                  ///< sum of the distances of all pairs
  double dual_bound = 0.0;            ///< no matching costs less, up to rounding
  std::uint32_t left_over = kNobody;  ///< the point without a partner where n is odd
  bool optimal = false;               ///< matched all at once: the optimum, up to rounding
  unsigned rounds = 0;                ///< rounds of windows; 0 where matched exactly
  /// windows matched in all rounds, including the first clusters or parts
  std::uint64_t windows = 0;

  /// The cost exceeds the optimum by at most this share of the bound.
  [[nodiscard]] double gap() const;
};

/// Matching of point sets of any size: the optimum up to a limit, beyond it a matching with a
/// proven gap.
///
/// points: in the plane or in space, finite; duplicates allowed. If their number is odd, one is
/// left over.
///
/// Method: compact parts (or the caller's clusters) are matched exactly and independently, in
/// parallel. Rounds of windows follow: the current pairs are cut into compact sets along different
/// lines, and each set is matched again. The current pairs of a window are one of its matchings, so
/// the cost never rises; a pair that suffered from the border of a part lies inside a window of the
/// next round. Rounds end when the windows no longer improve the matching.
///
/// Guarantee: dual_bound. The duals of the last windows (geometrically, discs and moats around the
/// points) are lowered until no pair from different windows is closer than they allow; half their
/// sum is a lower bound for every matching.
///
/// Returns: the same for the same input and options, for any number of threads.
/// Throws: std::invalid_argument as match_points(), and if the numbers of labels and points differ,
/// a window is below 4, or a tolerance is negative or NaN.
/// Cost: O(n log n) for cutting and the bound, and n / window exact matchings per round; about 130
/// bytes per point and 1 kB per point of the windows in progress (one per thread).
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.5.1 (first clusters, then
/// within them); the windows and the bound are ours. Duals as discs and moats: M. Jünger and W.
/// Pulleyblank, "Geometric duality and combinatorial optimization", 1993.
LargeMatching match_large(std::span<const Point2> points, const LargeMatchingOptions& options = {});
LargeMatching match_large(std::span<const Point3> points, const LargeMatchingOptions& options = {});

}  // namespace terrace::matching
