// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrace/matching/matching.hpp"
#include "terrace/matching/point.hpp"

/// Binary trees from repeated matching: the points are matched, each pair becomes a point of its
/// own, these are matched again, and so on until there is one. Source: J. Skála, Algorithms for
/// manipulating large geometric data, 7.5.1, figure 7.20.

namespace terrace::matching {

/// An inner node, numbered as in SciPy's linkage matrix: nodes 0 .. n-1 are the points, node n + r
/// is that which row r makes. Unlike there, rows are not sorted by distance.
struct MatchingTreeRow {
  std::uint32_t a, b;   ///< its children, a < b
  double distance;      ///< between the positions of the two
  std::uint32_t size;   ///< points below
  std::uint32_t level;  ///< the matching that made it, from 1 upward; above those of a and b
  friend bool operator==(const MatchingTreeRow&, const MatchingTreeRow&) = default;
};

template <class Point>
struct MatchingTree {
  /// One less than there are points, children before parents. The rows of a cluster are
  /// consecutive, clusters by ascending label, then those that join the clusters; within each by
  /// ascending level.
  std::vector<MatchingTreeRow> rows;
  /// For each row's node, the weighted mean of all points below it.
  std::vector<Point> positions;
  /// The last row's node; 0 for a single point; kNobody without points, and if stopped.
  std::uint32_t root = kNobody;
};

/// Matches the nodes of one level: the partner of each, kNobody for just one if their number is
/// odd.
template <class Point>
using LevelMatcher = std::function<std::vector<std::uint32_t>(std::span<const Point>)>;

template <class Point>
struct MatchingTreeOptions {
  std::span<const double> weights{};  ///< of each point, positive and finite; 1 where empty
  /// The cluster of each point, any numbers. Each cluster becomes a tree, then the roots of these
  /// are matched in the same way. Empty: all one cluster.
  std::span<const std::uint32_t> labels{};
  unsigned threads = 1;            ///< clusters at once, 0: one per core; never changes the result
  std::uint64_t memory_limit = 0;  ///< bytes that the tree may take; 0: no limit
  /// Called by the caller's thread now and then with the rows that are made and all there will be.
  /// False ends the work; the tree is empty then.
  std::function<bool(std::size_t done, std::size_t total)> progress{};
  /// In place of the library's own. Called by several threads at once where there are several.
  LevelMatcher<Point> matcher{};
};

/// The tree of repeated matching. Of an odd number of nodes the one left over rises to the next
/// level alone. A tree is as deep as it has levels at most: the logarithm of the largest cluster
/// rounded up, and that of the number of clusters.
///
/// points: finite; equal ones allowed.
/// Returns: the same for any number of threads.
/// Throws: std::invalid_argument for a coordinate that is not finite, a weight that is not positive
/// and finite (the index is named), weights whose sum passes the range of double, labels or weights
/// of another number than the points, too many points for the numbering or for
/// options.memory_limit (saying how many bytes), distances beyond the range of double, and a
/// matcher that returns no matching.
///
/// Cost: about twice the time of matching each cluster once. 24 bytes and a position a point for
/// the tree, 4 for the clusters, and what matching the largest clusters takes.
/// Source: J. Skála, 7.5.1.
[[nodiscard]] MatchingTree<Point2> make_matching_tree(
    std::span<const Point2> points, const MatchingTreeOptions<Point2>& options = {});
[[nodiscard]] MatchingTree<Point3> make_matching_tree(
    std::span<const Point3> points, const MatchingTreeOptions<Point3>& options = {});

}  // namespace terrace::matching
