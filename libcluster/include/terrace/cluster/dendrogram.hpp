// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

/// Dendrograms, the result of hierarchical clustering, in the convention of SciPy's linkage matrix,
/// and their cuts into flat clusters.

namespace terrace::cluster {

/// A row of a dendrogram. It merges clusters a and b. Clusters 0 ... n-1 are the points, and row r
/// creates cluster n+r.
struct Merge {
  std::uint32_t a, b;  ///< a < b
  double height;       ///< linkage distance of a and b
  std::uint32_t size;  ///< points in the new cluster
  friend bool operator==(const Merge&, const Merge&) = default;
};

struct Dendrogram {
  std::size_t points = 0;
  /// points - 1 rows in the order of the merges; empty if there are no points. Heights ascend,
  /// except for centroid and median linkage, where a merge may be lower than the merges of its
  /// parts (an inversion).
  std::vector<Merge> merges;
  friend bool operator==(const Dendrogram&, const Dendrogram&) = default;
};

/// A merge of the cluster of point i and the cluster of point j.
struct Link {
  std::uint32_t i, j;
  double height;
  friend bool operator==(const Link&, const Link&) = default;
};

/// The greatest number of points of a dendrogram, so that all its clusters have 32-bit numbers.
inline constexpr std::size_t kMostDendrogramPoints = std::size_t{1} << 31;

/// Returns the dendrogram of merges that are given in any order, such as the edges of a spanning
/// tree. Links of equal height keep their order, so in that order each must join two existing
/// clusters. Takes O(n log n) time.
/// Throws: std::invalid_argument if the number of links is not `points` - 1, or if a link joins
/// points that are already in one cluster, names a point that does not exist, or has a height that
/// is NaN or negative. The message names the link.
[[nodiscard]] Dendrogram make_dendrogram(std::size_t points, std::span<const Link> links,
                                         const base::StopCheck& check_stop = {});

/// Returns the dendrogram with its merges in the order of the links, whatever their heights. Takes
/// O(n) time. Throws: as make_dendrogram().
[[nodiscard]] Dendrogram make_dendrogram_in_order(std::size_t points, std::span<const Link> links,
                                                  const base::StopCheck& check_stop = {});

/// Returns the label of each point in flat clusters inside which no merge is higher than `height`
/// (SciPy: fcluster with criterion 'distance'). Labels are 0, 1, ... in the order of first
/// appearance. Takes O(n) time. Throws: std::invalid_argument if the height is NaN.
[[nodiscard]] std::vector<std::uint32_t> cut_height(const Dendrogram& dendrogram, double height);

/// Returns the label of each point in at most `count` flat clusters, which result from a cut at the
/// lowest possible height. There are fewer than `count` if merges of equal height prevent an exact
/// cut. Takes O(n log n) time.
/// Throws: std::invalid_argument if count is 0 or exceeds the number of points.
///
/// SciPy's fcluster with criterion 'maxclust' differs in two cases. It never cuts below its second
/// row, so it gives fewer clusters than possible for n and n - 1. After an inversion it may give
/// more than `count`.
[[nodiscard]] std::vector<std::uint32_t> cut_count(const Dendrogram& dendrogram, std::size_t count);

/// Returns the first fault of a dendrogram from another source and its row, or an empty string if
/// the dendrogram is valid. Inversions are valid. Takes O(n) time.
[[nodiscard]] std::string dendrogram_fault(const Dendrogram& dendrogram);

}  // namespace terrace::cluster
