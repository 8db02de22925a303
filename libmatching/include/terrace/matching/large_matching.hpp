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
  /// Sets of up to this many points are matched exactly, as by match_points(), unless labels are
  /// given.
  std::size_t exact_limit = 500'000;
  /// The cluster of each point, as arbitrary numbers. Each cluster is matched first, then the
  /// points left over in clusters of odd size. If empty, the set is cut into compact parts instead.
  std::span<const std::uint32_t> labels{};
  std::size_t window = 50'000;  ///< most points in a window, at least 4
  /// Maximum number of window rounds after the first matching. With 0 the matching of the clusters
  /// or parts is final.
  unsigned rounds = 8;
  /// Rounds end when one lowers the cost by at most this fraction.
  double tolerance = 1e-3;
  PointMetric metric{};  ///< Euclidean where `distance` is empty. Called from several threads
  unsigned threads = 1;  ///< 0: one per core. Never changes the result.
  /// Called on the caller's thread between windows with the number of windows matched so far, the
  /// number if all rounds are needed, and the current cost (0 until there is a complete matching).
  /// Returning false ends the rounds and keeps the current matching. It has no effect before there
  /// is one.
  std::function<bool(std::uint64_t done, std::uint64_t total, double cost)> progress = {};
  base::StopCheck check_stop = {};
};

struct LargeMatching {
  std::vector<std::uint32_t> mate;  ///< partner of each point, kNone for the one left over
  double cost = 0.0;                ///< sum of the distances of all pairs
  double dual_bound = 0.0;          ///< no matching costs less, up to rounding
  std::uint32_t left_over = kNone;  ///< the point without a partner where n is odd
  bool optimal = false;             ///< everything was matched at once: optimal up to rounding
  unsigned rounds = 0;              ///< rounds of windows, or 0 where matched exactly
  /// windows matched in all rounds, including the first clusters or parts
  std::uint64_t windows = 0;

  /// Bounds the excess of the cost over the optimum, as a fraction of dual_bound.
  [[nodiscard]] double gap() const;
};

/// Matches a point set of any size: optimally up to options.exact_limit points, beyond that with a
/// proven gap.
///
/// points: in the plane or in space, finite. Duplicates are allowed. One point is left over if
/// their number is odd.
///
/// Method: compact parts (or the caller's clusters) are matched exactly and independently, in
/// parallel. Rounds of windows follow: the current pairs are cut into compact sets along different
/// lines, and each set is matched again. The current pairs of a window are one of its possible
/// matchings, so the cost never rises. A pair that was constrained by the border of a part is
/// inside a window of the next round. Rounds end when the windows no longer improve the matching.
///
/// Guarantee: dual_bound. The duals of the last windows (geometrically, discs and moats around the
/// points) are lowered until no pair from different windows is closer than they allow. Half their
/// sum is then a lower bound for every matching.
///
/// Returns: the same for the same input and options, for any number of threads.
/// Throws: std::invalid_argument as match_points() does, and if the numbers of labels and points
/// differ, the window is below 4, or the tolerance is negative or NaN.
/// Cost: O(n log n) for cutting and the bound, and n / window exact matchings per round. Memory:
/// about 130 bytes per point and 1 kB per point of the windows in progress (one per thread).
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.5.1 (first clusters, then
/// within them). The windows and the bound are ours. Duals as discs and moats: M. Jünger and W.
/// Pulleyblank, "Geometric duality and combinatorial optimization", 1993.
LargeMatching match_large(std::span<const Point2> points, const LargeMatchingOptions& options = {});
LargeMatching match_large(std::span<const Point3> points, const LargeMatchingOptions& options = {});

}  // namespace terrace::matching
