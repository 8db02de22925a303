// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

/// Dendrograms: the result of hierarchical clustering, in the convention of SciPy's linkage matrix,
/// and their cuts into flat clusters.

namespace terrace::cluster {

/// One row: clusters a and b are merged. Clusters 0..n-1 are the points, cluster n+r is made by row
/// r.
struct Merge {
  std::uint32_t a, b;  ///< a < b
  double height;       ///< linkage distance of a and b
  std::uint32_t size;  ///< points in the new cluster
  friend bool operator==(const Merge&, const Merge&) = default;
};

struct Dendrogram {
  std::size_t points = 0;
  /// points - 1 rows, in the order of the merges; empty for no points. Heights ascend, except for
  /// centroid and median linkage, where a merge may be lower than those of its parts (an
  /// inversion).
  std::vector<Merge> merges;
  friend bool operator==(const Dendrogram&, const Dendrogram&) = default;
};

/// A merge given by two points: the cluster of i and the cluster of j are merged.
struct Link {
  std::uint32_t i, j;
  double height;
  friend bool operator==(const Link&, const Link&) = default;
};

/// The greatest number of points of a dendrogram: all its clusters have 32-bit numbers.
inline constexpr std::size_t kMostDendrogramPoints = std::size_t{1} << 31;

/// The dendrogram of merges in any order (the edges of a spanning tree) or, with equal heights, in
/// an order in which each is possible (a nearest-neighbour chain). Links of equal height keep their
/// order. O(n log n) time.
/// Throws std::invalid_argument if the number of links is not `points` - 1, or if one of them joins
/// points that are already in one cluster, names a point that does not exist, or has a height that
/// is NaN or negative; the message names the link.
[[nodiscard]] Dendrogram make_dendrogram(std::size_t points, std::span<const Link> links,
                                         const base::StopCheck& check_stop = {});

/// The same with the merges in the order of the links, whatever their heights. O(n).
[[nodiscard]] Dendrogram make_dendrogram_in_order(std::size_t points, std::span<const Link> links,
                                                  const base::StopCheck& check_stop = {});

/// Flat clusters inside which no merge is higher than `height` (SciPy: fcluster with criterion
/// 'distance'). Returns the label of each point; labels are 0, 1, .. in the order of first
/// appearance. O(n). Throws std::invalid_argument if the height is NaN.
[[nodiscard]] std::vector<std::uint32_t> cut_height(const Dendrogram& dendrogram, double height);

/// At most `count` flat clusters, by a cut at the lowest height that leaves no more. There are
/// fewer if merges of equal height leave no choice (SciPy: fcluster with criterion 'maxclust',
/// which however never cuts below its second row and so gives fewer than possible for n and n - 1,
/// and may leave more than possible after an inversion). O(n log n). Throws std::invalid_argument
/// if count is 0 or exceeds the number of points.
[[nodiscard]] std::vector<std::uint32_t> cut_count(const Dendrogram& dendrogram, std::size_t count);

/// The first fault of a dendrogram from another source, naming the row; empty if it is valid.
/// Inversions are valid. O(n).
[[nodiscard]] std::string dendrogram_fault(const Dendrogram& dendrogram);

}  // namespace terrace::cluster
