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
/// points are matched again, and so on until one is left. Source: J. Skála, Algorithms for
/// manipulating large geometric data, 7.5.1, figure 7.20.

namespace terrace::matching {

/// An inner node, numbered as in SciPy's linkage matrix: nodes 0 .. n-1 are the points, and row r
/// makes node n + r. Unlike SciPy's, the rows are not sorted by distance.
struct MatchingTreeRow {
  std::uint32_t a, b;   ///< its children, a < b
  double distance;      ///< distance between the positions of a and b
  std::uint32_t size;   ///< points below
  std::uint32_t level;  ///< the matching that made it, from 1; above the levels of a and b
  friend bool operator==(const MatchingTreeRow&, const MatchingTreeRow&) = default;
};

template <class Point>
struct MatchingTree {
  /// One row fewer than points, children before parents. The rows of a cluster are consecutive, and
  /// clusters are in order of ascending label. The rows that join the clusters follow. Within each
  /// of these groups, rows are in order of ascending level.
  std::vector<MatchingTreeRow> rows;
  /// The weighted mean of all points below each row's node.
  std::vector<Point> positions;
  /// The last row's node, or 0 for a single point. kNone if there are no points or the work was
  /// stopped.
  std::uint32_t root = kNone;
};

/// Matches the nodes of one level. Returns the partner of each node. Exactly one is kNone if the
/// number of nodes is odd.
template <class Point>
using LevelMatcher = std::function<std::vector<std::uint32_t>(std::span<const Point>)>;

template <class Point>
struct MatchingTreeOptions {
  std::span<const double> weights{};  ///< positive and finite, one per point; all 1 where empty
  /// The cluster of each point, as arbitrary numbers. Each cluster becomes a tree. Then the roots
  /// are matched in the same way. If empty, all points are one cluster.
  std::span<const std::uint32_t> labels{};
  unsigned threads = 1;  ///< concurrent clusters, 0 for one per core. Does not change the result
  std::uint64_t memory_limit = 0;  ///< limit for the tree, in bytes. 0 means none
  /// Called on the caller's thread at intervals with the number of rows made so far and their
  /// total. Returning false ends the work and makes the tree empty.
  std::function<bool(std::size_t done, std::size_t total)> progress{};
  base::StopCheck check_stop{};  ///< not passed to `matcher`
  /// Replaces the library's own matcher. Called concurrently if there are several threads.
  LevelMatcher<Point> matcher{};
};

/// The tree of repeated matching. If the number of nodes is odd, the node left over rises alone to
/// the next level. The depth is at most the number of levels: the base-2 logarithm of the size of
/// the largest cluster, rounded up, plus that of the number of clusters.
///
/// points: finite. Duplicates are allowed.
/// Returns: the same tree for any number of threads.
/// Throws: std::invalid_argument for a coordinate that is not finite, a weight that is not positive
/// and finite (the message gives the index), weights whose sum overflows a double, numbers of
/// labels or weights other than the number of points, too many points for the numbering or for
/// options.memory_limit (the message gives the memory needed), distances beyond the range of
/// double, and a matcher that does not return a matching.
///
/// Cost: about twice the time of matching each cluster once. The tree takes 24 bytes and a position
/// per point, and the clusters 4 bytes per point, plus the memory for matching the largest
/// clusters.
/// Source: J. Skála, 7.5.1.
[[nodiscard]] MatchingTree<Point2> make_matching_tree(
    std::span<const Point2> points, const MatchingTreeOptions<Point2>& options = {});
[[nodiscard]] MatchingTree<Point3> make_matching_tree(
    std::span<const Point3> points, const MatchingTreeOptions<Point3>& options = {});

}  // namespace terrace::matching
