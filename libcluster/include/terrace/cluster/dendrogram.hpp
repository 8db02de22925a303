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

/// One row, which merges clusters a and b. Clusters 0..n-1 are the points, and row r makes cluster
/// n+r.
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

/// A merge given by two points: it joins the cluster of i and the cluster of j.
struct Link {
  std::uint32_t i, j;
  double height;
  friend bool operator==(const Link&, const Link&) = default;
};

/// The greatest number of points of a dendrogram, so that all its clusters have 32-bit numbers.
inline constexpr std::size_t kMostDendrogramPoints = std::size_t{1} << 31;

/// Makes a dendrogram from merges in any order (the edges of a spanning tree) or, with equal
/// heights, in an order in which each is possible (a nearest-neighbour chain). Links of equal
/// height keep their order. Takes O(n log n) time.
/// Throws: std::invalid_argument if the number of links is not `points` - 1, or if a link joins
/// points that are already in one cluster, names a point that does not exist, or has a height that
/// is NaN or negative. The message names the link.
[[nodiscard]] Dendrogram make_dendrogram(std::size_t points, std::span<const Link> links,
                                         const base::StopCheck& check_stop = {});

/// Makes a dendrogram with the merges in the order of the links, whatever their heights. Takes
/// O(n).
[[nodiscard]] Dendrogram make_dendrogram_in_order(std::size_t points, std::span<const Link> links,
                                                  const base::StopCheck& check_stop = {});

/// Returns the label of each point in flat clusters inside which no merge is higher than `height`
/// (SciPy: fcluster with criterion 'distance'). Labels are 0, 1, .. in the order of first
/// appearance. Takes O(n). Throws: std::invalid_argument if the height is NaN.
[[nodiscard]] std::vector<std::uint32_t> cut_height(const Dendrogram& dendrogram, double height);

/// Returns the label of each point in at most `count` flat clusters, by a cut at the lowest height
/// that leaves no more. There are fewer if merges of equal height leave no choice. (SciPy's
/// fcluster with criterion 'maxclust' never cuts below its second row, so it gives fewer clusters
/// than possible for n and n - 1, and may leave more than `count` after an inversion.) Takes O(n
/// log n).
/// Throws: std::invalid_argument if count is 0 or exceeds the number of points.
[[nodiscard]] std::vector<std::uint32_t> cut_count(const Dendrogram& dendrogram, std::size_t count);

/// Returns the first fault of a dendrogram from another source and its row, or an empty string if
/// the dendrogram is valid. Inversions are valid. Takes O(n).
[[nodiscard]] std::string dendrogram_fault(const Dendrogram& dendrogram);

}  // namespace terrace::cluster
