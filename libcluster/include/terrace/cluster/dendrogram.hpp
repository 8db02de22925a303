// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Dendrograms: what hierarchical clustering returns, in the convention of SciPy's linkage matrix,
/// and their cuts into flat clusters.

namespace terrace::cluster {

/// One row: clusters a and b become one. Clusters 0..n-1 are the points, cluster n+r is that which
/// row r makes.
struct Merge {
  std::uint32_t a, b;  ///< a < b
  double height;       ///< linkage distance of a and b
  std::uint32_t size;  ///< points in the new cluster
  friend bool operator==(const Merge&, const Merge&) = default;
};

struct Dendrogram {
  std::size_t points = 0;
  std::vector<Merge> merges;  ///< points - 1 rows, heights ascending; empty for no points
  friend bool operator==(const Dendrogram&, const Dendrogram&) = default;
};

/// A merge by two of the points: the cluster that holds i and that which holds j become one.
struct Link {
  std::uint32_t i, j;
  double height;
  friend bool operator==(const Link&, const Link&) = default;
};

/// The greatest number of points of a dendrogram: all its clusters have 32-bit numbers.
inline constexpr std::size_t kMostDendrogramPoints = std::size_t{1} << 31;

/// The dendrogram of merges that come in any order (the edges of a spanning tree) or with equal
/// heights in an order in which each is possible (a nearest-neighbour chain). Links of equal height
/// keep their order. O(n log n) time.
/// Throws std::invalid_argument if the links are not `points` - 1, one of them is between points
/// that are one cluster already, names a point that does not exist, or has a height that is NaN or
/// negative; the message names the link.
[[nodiscard]] Dendrogram make_dendrogram(std::size_t points, std::span<const Link> links);

/// Flat clusters in which no two points have a greater cophenetic distance than `height`: all
/// merges up to it, inclusive (SciPy: fcluster with criterion 'distance'). Returns the label of
/// each point; labels are 0, 1, .. in the order in which they first appear. O(n). Throws
/// std::invalid_argument if the height is NaN.
[[nodiscard]] std::vector<std::uint32_t> cut_height(const Dendrogram& dendrogram, double height);

/// At most `count` flat clusters by a cut at the lowest height that leaves no more. There are fewer
/// where merges of equal height leave no choice (SciPy: fcluster with criterion 'maxclust', which
/// however never cuts below its second row and so gives fewer than it could for n and n - 1).
/// Throws std::invalid_argument if count is 0 or exceeds the number of points.
[[nodiscard]] std::vector<std::uint32_t> cut_count(const Dendrogram& dendrogram, std::size_t count);

/// The first fault of a dendrogram that did not come from this library, naming the row; empty if
/// it is valid. O(n).
[[nodiscard]] std::string dendrogram_fault(const Dendrogram& dendrogram);

}  // namespace terrace::cluster
