// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/point.hpp"

/// Single linkage of points with Euclidean distances: the distance of two clusters is that of their
/// nearest points. Its dendrogram is the minimum spanning tree with the edges sorted by length.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.1. The tree: O. Borůvka,
/// O jistém problému minimálním, 1926, over a kD-tree (see src/spanning_tree.hpp).

namespace terrace::cluster {

struct SingleLinkageOptions {
  unsigned threads = 1;  ///< never change the result
};

/// A pair of points by their numbers.
using PointPair = std::array<std::uint32_t, 2>;

/// The dendrogram of points in space or, with z = 0, in the plane. O(n log n) time for points that
/// are not contrived, many equal ones and regular grids included; about 170 bytes of memory a
/// point. Heights are exact to the last bits of a double; distances below 1e-150 of the largest
/// coordinate may count as zero. Where distances are equal the tree is one of several; it depends
/// on the points and their order alone.
///
/// Throws std::invalid_argument, which names the point, if a coordinate is not finite or beyond
/// 1e307 in magnitude.
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        const SingleLinkageOptions& options = {});

/// The same if only the given pairs are candidates. It is the dendrogram of the points if the pairs
/// contain the edges of a Delaunay triangulation (Shamos, Hoey: Closest-point problems, 1975).
/// Pairs may come twice and in either order. O(e log e) time for e pairs.
/// Throws std::invalid_argument as above; also if a pair names a point that there is not, and if
/// the pairs leave a point without a way to point 0 (naming it).
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        std::span<const PointPair> candidates);

/// The edges of the minimum spanning tree itself, each with its length, in no particular order.
[[nodiscard]] std::vector<Link> spanning_tree(std::span<const Point3> points,
                                              const SingleLinkageOptions& options = {});

}  // namespace terrace::cluster
