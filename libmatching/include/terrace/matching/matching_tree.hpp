// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

/// Binary trees from repeated matching: the points are matched, each pair becomes a point, these
/// are matched again, and so on until one is left. Source: J. Skála, Algorithms for manipulating
/// large geometric data, 7.5.1, figure 7.20.

namespace terrace::matching {

/// An inner node, numbered as in SciPy's linkage matrix: nodes 0 .. n-1 are the points, node n + r
/// is made by row r. Unlike SciPy's, the rows are not sorted by distance.
struct MatchingTreeRow {
  std::uint32_t a, b;   ///< its children, a < b
  double distance;      ///< distance between the positions of a and b
  std::uint32_t size;   ///< points below
  std::uint32_t level;  ///< the matching that made it, from 1; above the levels of a and b
  friend bool operator==(const MatchingTreeRow&, const MatchingTreeRow&) = default;
};

template <class Point>
struct MatchingTree {
  /// One row fewer than points, children before parents. The rows of a cluster are consecutive,
  /// clusters by ascending label; the rows that join the clusters follow. Within each group rows
  /// are by ascending level.
  std::vector<MatchingTreeRow> rows;
  /// For each row's node, the weighted mean of all points below it.
  std::vector<Point> positions;
  /// the last row's node; 0 for a single point; kNobody without points or if stopped
  std::uint32_t root = kNobody;
};

/// Matches the nodes of one level: returns the partner of each, kNobody for exactly one if their
/// number is odd.
template <class Point>
using LevelMatcher = std::function<std::vector<std::uint32_t>(std::span<const Point>)>;

template <class Point>
struct MatchingTreeOptions {
  std::span<const double> weights{};  ///< positive and finite, one per point; all 1 where empty
  /// The cluster of each point, as arbitrary numbers. Each cluster becomes a tree, then the roots
  /// are matched in the same way. Empty: one cluster.
  std::span<const std::uint32_t> labels{};
  unsigned threads = 1;  ///< concurrent clusters, 0: one per core; does not change the result
  std::uint64_t memory_limit = 0;  ///< bytes that the tree may take; 0: no limit
  /// Called by the caller's thread at intervals with the rows made so far and their total. False
  /// ends the work; the tree is then empty.
  std::function<bool(std::size_t done, std::size_t total)> progress{};
  base::StopCheck check_stop{};  ///< not heard by `matcher`
  /// Replaces the library's own matcher. Called concurrently where there are several threads.
  LevelMatcher<Point> matcher{};
};

/// The tree of repeated matching. If the number of nodes is odd, the one left over rises to the
/// next level alone. The depth is at most the number of levels: the logarithm of the largest
/// cluster's size rounded up, plus that of the number of clusters.
///
/// points: finite; duplicates allowed.
/// Returns: the same for any number of threads.
/// Throws: std::invalid_argument for a coordinate that is not finite, a weight that is not positive
/// and finite (the index is named), weights whose sum overflows a double, a number of labels or
/// weights that differs from that of the points, too many points for the numbering or for
/// options.memory_limit (the bytes needed are named), distances beyond the range of double, and a
/// matcher that does not return a matching.
///
/// Cost: about twice the time of matching each cluster once. 24 bytes and a position per point for
/// the tree, 4 bytes per point for the clusters, and the memory for matching the largest clusters.
/// Source: J. Skála, 7.5.1.
[[nodiscard]] MatchingTree<Point2> make_matching_tree(
    std::span<const Point2> points, const MatchingTreeOptions<Point2>& options = {});
[[nodiscard]] MatchingTree<Point3> make_matching_tree(
    std::span<const Point3> points, const MatchingTreeOptions<Point3>& options = {});

}  // namespace terrace::matching
