// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/point.hpp"

/// k-means: finds k centres, not necessarily points of the input, with a low sum of squared
/// distances
///     SSE = sum of weight(i) * |point i - its centre|^2.
/// Lloyd's iteration (assign each point to the nearest centre, move each centre to the mean of its
/// points) starts from k-means++ seeds or from the caller's centres. It is exact: a filter over a
/// tree of boxes rules out only centres that cannot be nearest to any point of a box.
/// Sources: S. Lloyd, Least squares quantization in PCM, IEEE Trans. Inf. Theory 28 (1982);
/// D. Arthur, S. Vassilvitskii, k-means++: the advantages of careful seeding, SODA 2007;
/// T. Kanungo et al., An efficient k-means clustering algorithm: analysis and implementation, IEEE
/// Trans. PAMI 24 (2002).

namespace terrace::cluster {

struct KMeansOptions {
  std::size_t clusters = 8;          ///< k, from 1 to the number of points
  std::uint64_t seed = 1;            ///< seed of k-means++
  std::size_t restarts = 1;          ///< runs from different seeds; the best one is returned
  std::size_t max_iterations = 300;  ///< per run; 0 only assigns
  /// A run ends when no centre moves by more than this fraction of the diagonal of the points'
  /// bounding box. With 0 it ends when no assignment changes.
  double tolerance = 0.0;
  unsigned threads = 1;  ///< 0 counts as 1
  base::StopCheck check_stop = {};
};

struct KMeansResult {
  std::vector<Point3> centres;
  /// The nearest centre of each point, the one with the lowest number on ties.
  std::vector<std::uint32_t> assignment;
  double sse = 0.0;            ///< in the square of the points' unit
  std::size_t iterations = 0;  ///< number of times the points were assigned and centres moved
  bool converged = false;      ///< false: max_iterations ended the run
};

/// Clusters n points.
/// points: positions, finite, of any offset and scale; 2D data has z = 0. n < 2^32.
/// weights: n positive finite numbers, or empty for 1 each. A weight below 2^-500 times the
/// greatest counts as 2^-500 times the greatest.
///
/// Seeds come from greedy k-means++, which tries 2 + 0.7 log2(k) points per centre and takes the
/// best. Clusters that lose all their points get new ones, in the order of their numbers. Each gets
/// the point with the highest cost (weight times squared distance; the lowest index on ties) of all
/// clusters with at least two points. Points at their centre, within 2^-36 of the bounding box's
/// longest side, do not move. So with fewer than k distinct points the surplus clusters stay empty,
/// and their centres are at some point of the input.
///
/// The result depends on points, their order, weights and options, but not on threads. Assignments
/// equal those of plain Lloyd from the same centres. The centres are equal up to rounding, because
/// the sums of boxes are reused.
/// Throws: std::invalid_argument if a point or weight is out of range (the message gives its
/// index), k is 0 or above n, restarts is 0, or tolerance is negative or NaN.
/// Cost: O(n log n) for the tree, then O(n) per iteration in the worst case. Only points near the
/// borders of clusters are examined singly. 100,000 points in the plane with k = 100 take less than
/// a millisecond per iteration. Needs about 80 bytes of memory per point.
[[nodiscard]] KMeansResult k_means(std::span<const Point3> points, std::span<const double> weights,
                                   const KMeansOptions& options);

/// Clusters as k_means() does, from the caller's centres: at least one and at most n, finite.
/// Ignores options.clusters, seed and restarts.
[[nodiscard]] KMeansResult k_means_from(std::span<const Point3> centres,
                                        std::span<const Point3> points,
                                        std::span<const double> weights,
                                        const KMeansOptions& options);

/// Returns the index of a representative point for each of `clusters` flat clusters: the point
/// nearest to the mean of its cluster, the first one on ties, or 0 for a cluster without points.
/// labels: the cluster of each point, below `clusters`. Takes O(n).
[[nodiscard]] std::vector<std::uint32_t> nearest_to_means(std::span<const Point3> points,
                                                          std::span<const std::uint32_t> labels,
                                                          std::size_t clusters);

}  // namespace terrace::cluster
