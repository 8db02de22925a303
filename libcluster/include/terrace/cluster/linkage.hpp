// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/band_matrix.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/point.hpp"

/// Hierarchical clustering with the complete dendrogram, by the seven methods of SciPy's linkage().
/// Clusters points in space or, with z = 0, in the plane, with Euclidean distances, or items with
/// any other distance. Single and complete linkage also run on a GPU.
///
/// If distances are equal there are several valid dendrograms. Which one is returned depends only
/// on the input and its order, not on threads or instruction set.
///
/// Sources: J. Skála, Algorithms for manipulating large geometric data, 4.2.1, 7.6; D. Müllner,
/// Modern hierarchical, agglomerative clustering algorithms, 2011.

namespace terrace::cluster {

/// The type of the entries of a distance matrix.
enum class MatrixEntry {
  /// Half the memory of float64. Each distance is rounded to float once, so heights have a relative
  /// error below 1e-7, and clusters whose distances differ by less may merge in another order.
  /// Distances of points below 1e-18 of the largest coordinate may count as zero.
  float32,
  /// Heights of points are exact to the last bits. Distances of points below 1e-150 of the largest
  /// coordinate may count as zero.
  float64,
};

struct LinkageOptions {
  unsigned threads = 1;  ///< does not change the result
  /// Applies where there is a matrix: complete, average and weighted linkage, and every method on
  /// given distances.
  MatrixEntry entry = MatrixEntry::float64;
  /// Limit in bytes for the matrix, or for the means of ward, centroid and median linkage; 0: no
  /// limit.
  std::uint64_t memory_limit = 0;
  SimdPath path = SimdPath::automatic;
  base::StopCheck check_stop = {};
};

/// Single linkage: the distance of two clusters is the distance of their nearest points. The
/// dendrogram is the minimum spanning tree with its edges sorted by length. Takes O(n log n) time
/// for non-adversarial points, including many duplicates and regular grids, and about 170 bytes of
/// memory per point. Heights are exact to the last bits of a double. Distances below 1e-150 of the
/// largest coordinate may count as zero.
/// Source: O. Borůvka, O jistém problému minimálním, 1926, over a kd-tree.
/// Throws: std::invalid_argument if a coordinate is not finite or exceeds 1e307 in magnitude. The
/// message names the point.
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        const LinkageOptions& options = {});

/// A pair of points by index.
using PointPair = std::array<std::uint32_t, 2>;

/// Single linkage restricted to the given candidate pairs. If the pairs contain the edges of a
/// Delaunay triangulation, the result is the dendrogram of the points (Shamos, Hoey: Closest-point
/// problems, 1975). Pairs may be repeated, in either order. Takes O(e log e) time for e pairs.
/// Throws: std::invalid_argument as above, if a pair names a point that does not exist, and if the
/// pairs do not connect a point with point 0 (the message names the point).
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        std::span<const PointPair> candidates,
                                        const base::StopCheck& check_stop = {});

/// Returns the edges of the minimum spanning tree with their lengths, in no particular order.
[[nodiscard]] std::vector<Link> spanning_tree(std::span<const Point3> points,
                                              const LinkageOptions& options = {});

/// Complete linkage: the distance of two clusters is the distance of their farthest points. Uses
/// half the matrix of distances, n * floor(n / 2) entries, and O(n^2) time. Two clusters that are
/// each other's nearest always merge, so each round merges all such pairs in one pass over the
/// matrix, which shrinks with the clusters. If a round finds few pairs, a nearest-neighbour chain
/// takes over until a quarter of the clusters is gone. Needs about 200 bytes per point in addition
/// to the matrix.
/// Source: F. Murtagh, A survey of recent advances in hierarchical clustering algorithms, 1983.
/// Throws: std::invalid_argument if a coordinate is not finite or exceeds 1e307 in magnitude (the
/// message names the point), and if the matrix exceeds the limit (the message gives the bytes
/// needed).
[[nodiscard]] Dendrogram complete_linkage(std::span<const Point3> points,
                                          const LinkageOptions& options = {});

/// The distance of two items given by index, i < j. Called once for each pair, and before that
/// about 3 n log n times to find a good order. Called concurrently if there are several threads.
/// Exceptions are passed on to the caller.
using PairDistance = std::function<double(std::uint32_t i, std::uint32_t j)>;

/// Complete linkage of `count` items of any kind.
/// Throws: std::invalid_argument if a distance is negative or not finite (in float, if the entries
/// are float; the message names the pair), and as above for the matrix.
[[nodiscard]] Dendrogram complete_linkage(std::size_t count, const PairDistance& distance,
                                          const LinkageOptions& options = {});

/// Complete linkage of a filled matrix of distances (band_matrix.hpp). Faster if near items have
/// near indices. Consumes the matrix and ignores options.entry and memory_limit.
/// Throws: std::invalid_argument if an entry is negative or not finite, or the two copies of a
/// duplicated pair differ. The message names the pair.
template <class T>
[[nodiscard]] Dendrogram complete_linkage(BandMatrix<T>&& distances,
                                          const LinkageOptions& options = {});

extern template Dendrogram complete_linkage(BandMatrix<float>&&, const LinkageOptions&);
extern template Dendrogram complete_linkage(BandMatrix<double>&&, const LinkageOptions&);

/// How the distance of two clusters is defined.
enum class LinkageMethod : std::uint8_t {
  single,    ///< distance of their nearest points
  complete,  ///< distance of their farthest points
  average,   ///< mean distance over all pairs of points (UPGMA)
  weighted,  ///< mean of the distances to the two parts of a cluster (WPGMA)
  ward,      ///< sqrt(2 |a| |b| / (|a| + |b|)) times the distance of their means
  centroid,  ///< distance of their means (UPGMC)
  /// distance of their middles; the middle of a new cluster is midway between those of its parts
  /// (WPGMC)
  median,
};

/// Returns the method with the name above, or nullopt for any other name.
[[nodiscard]] std::optional<LinkageMethod> linkage_method_named(std::string_view name);

/// Linkage by any method. Takes O(n^2) time except for single linkage.
/// - ward: a nearest-neighbour chain over means, without a matrix; 120 bytes per point.
/// - average, weighted: a chain over a matrix of n (n - 1) / 2 entries, and about 50 bytes per
///   point. With float entries each merge rounds its distances to float. Equals SciPy's result in
///   every bit, ties included.
/// - centroid, median: repeatedly merges the nearest two clusters, on ties the first pair, without
///   a matrix; 120 bytes per point. A merge may be lower than the merges of its parts. Rows are in
///   the order of the merges.
///
/// Throws: std::invalid_argument as single_linkage() does, and if the memory limit is exceeded (the
/// message gives the bytes needed).
/// Sources: F. Murtagh, 1983; W. Day, H. Edelsbrunner, Efficient algorithms for agglomerative
/// hierarchical clustering methods, 1984.
[[nodiscard]] Dendrogram linkage(std::span<const Point3> points, LinkageMethod method,
                                 const LinkageOptions& options = {});

/// Linkage of `count` items of any kind by any method, over a matrix. Ward, centroid and median
/// linkage are meaningful for Euclidean distances only.
/// Throws: std::invalid_argument as complete_linkage() of items does.
[[nodiscard]] Dendrogram linkage(std::size_t count, const PairDistance& distance,
                                 LinkageMethod method, const LinkageOptions& options = {});

struct CudaStatus {
  bool available = false;
  std::string device;  ///< name of the GPU, if available
  std::string reason;  ///< if not available: the reason, and what to do
};

/// Returns whether this build has CUDA and this machine has a usable device. The device is the
/// current one, which is the first unless the caller or CUDA_VISIBLE_DEVICES chose another.
[[nodiscard]] CudaStatus cuda_available();

/// Complete linkage entirely on the GPU. Only two counters per round and the final merges are
/// copied back. Heights equal those of complete_linkage() with the same entries, and so does the
/// dendrogram unless distances are equal. Device memory: n * n / 2 entries, and up to 0.64 times
/// that again when the matrix is rebuilt for the clusters of a round, so 1.3 GB for 20,000 points
/// in float. Takes O(n^2) work per halving of the clusters if rounds find many pairs, and O(n)
/// rounds in the worst case (points in geometric progression). Differences from the thesis: all
/// reciprocal nearest neighbours merge at once, and the matrix shrinks with the clusters.
/// Throws: std::invalid_argument for points as complete_linkage() does, or if the device has too
/// little memory (the message gives the bytes needed); std::runtime_error with the reason if
/// cuda_available() reports no device, or if the device fails.
[[nodiscard]] Dendrogram cuda_complete_linkage(std::span<const Point3> points,
                                               MatrixEntry entry = MatrixEntry::float64);

/// Single linkage on the GPU, without a matrix, with the heights of single_linkage(). Takes O(n^2
/// log n) work in at most log2 n rounds, in double precision, and up to 850 bytes of device memory
/// per point. single_linkage() on the CPU is subquadratic. Throws: as cuda_complete_linkage().
[[nodiscard]] Dendrogram cuda_single_linkage(std::span<const Point3> points);

}  // namespace terrace::cluster
