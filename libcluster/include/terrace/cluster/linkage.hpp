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

/// Hierarchical clustering with the complete dendrogram, by the seven methods of SciPy's linkage(),
/// of points in space or, with z = 0, in the plane, with Euclidean distances, or of things with any
/// other distance; single and complete linkage also on a GPU.
///
/// If distances are equal there are several valid dendrograms; which one is returned depends only
/// on the input and its order, not on threads or instruction set.
/// Sources: J. Skála, Algorithms for manipulating large geometric data, 4.2.1, 7.6; D. Müllner,
/// Modern hierarchical, agglomerative clustering algorithms, 2011.

namespace terrace::cluster {

/// The entries of a matrix of distances.
enum class MatrixEntry {
  /// Half the memory. Each distance is rounded to float once, so heights have a relative error
  /// below 1e-7, and clusters whose distances differ by less may merge in another order. Distances
  /// of points below 1e-18 of the largest coordinate may count as zero.
  float32,
  /// Heights of points are exact to the last bits. Distances of points below 1e-150 of the largest
  /// coordinate may count as zero.
  float64,
};

struct LinkageOptions {
  unsigned threads = 1;  ///< does not change the result
  /// For what uses a matrix: complete, average and weighted linkage, and all linkage of distances.
  MatrixEntry entry = MatrixEntry::float64;
  /// Bytes the matrix may take, or the means of ward, centroid and median linkage; 0: no limit.
  std::uint64_t memory_limit = 0;
  SimdPath path = SimdPath::automatic;
  base::StopCheck check_stop = {};
};

/// Single linkage: the distance of two clusters is that of their nearest points. Its dendrogram is
/// the minimum spanning tree with the edges sorted by length. O(n log n) time for non-adversarial
/// points, including many duplicates and regular grids; about 170 bytes of memory per point.
/// Heights are exact to the last bits of a double; distances below 1e-150 of the largest coordinate
/// may count as zero.
/// Source: O. Borůvka, O jistém problému minimálním, 1926, over a kD-tree.
/// Throws: std::invalid_argument, naming the point, if a coordinate is not finite or beyond 1e307
/// in magnitude.
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        const LinkageOptions& options = {});

/// A pair of points by index.
using PointPair = std::array<std::uint32_t, 2>;

/// Single linkage restricted to the given candidate pairs. It is the dendrogram of the points if
/// the pairs contain the edges of a Delaunay triangulation (Shamos, Hoey: Closest-point problems,
/// 1975). Pairs may be repeated, in either order. O(e log e) time for e pairs.
/// Throws: std::invalid_argument as above; also if a pair names a point that does not exist, and if
/// the pairs do not connect a point with point 0 (naming it).
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        std::span<const PointPair> candidates);

/// The edges of the minimum spanning tree itself, with lengths, in no particular order.
[[nodiscard]] std::vector<Link> spanning_tree(std::span<const Point3> points,
                                              const LinkageOptions& options = {});

/// Complete linkage: the distance of two clusters is that of their farthest points. Over half the
/// matrix of distances, n * floor(n / 2) entries, in O(n^2) time: clusters that are each other's
/// nearest will merge, whatever happens elsewhere, so in each round all such pairs merge in one
/// pass over the matrix, which shrinks with the clusters; if a round finds few, a nearest-neighbour
/// chain takes over until a quarter of the clusters is gone. Besides the matrix it takes about 200
/// bytes per point.
/// Source: F. Murtagh, A survey of recent advances in hierarchical clustering algorithms, 1983.
/// Throws: std::invalid_argument, naming the point, if a coordinate is not finite or beyond 1e307
/// in magnitude; and, naming the bytes needed, if the matrix exceeds the limit.
[[nodiscard]] Dendrogram complete_linkage(std::span<const Point3> points,
                                          const LinkageOptions& options = {});

/// The distance of two things by index, i < j. Called once for each pair, and before that about 3 n
/// log n times to find a good order; concurrently if there are several threads. Its exceptions are
/// thrown by complete_linkage().
using PairDistance = std::function<double(std::uint32_t i, std::uint32_t j)>;

/// Complete linkage of `count` things of any kind. Throws: std::invalid_argument, naming the pair,
/// if a distance is negative or not finite (in float, if the entries are float); and as above for
/// the matrix.
[[nodiscard]] Dendrogram complete_linkage(std::size_t count, const PairDistance& distance,
                                          const LinkageOptions& options = {});

/// Complete linkage of a filled matrix of distances (band_matrix.hpp). Faster if things close to
/// each other have close indices. The matrix is consumed; options.entry and memory_limit are
/// ignored. Throws: std::invalid_argument, naming the pair, if an entry is negative or not finite,
/// or the two copies of a duplicated pair differ.
template <class T>
[[nodiscard]] Dendrogram complete_linkage(BandMatrix<T>&& distances,
                                          const LinkageOptions& options = {});

extern template Dendrogram complete_linkage(BandMatrix<float>&&, const LinkageOptions&);
extern template Dendrogram complete_linkage(BandMatrix<double>&&, const LinkageOptions&);

/// The distance of two clusters.
enum class LinkageMethod : std::uint8_t {
  single,    ///< of their nearest points
  complete,  ///< of their farthest points
  average,   ///< the mean over all pairs of points (UPGMA)
  weighted,  ///< the mean of the distances of the two parts of a cluster (WPGMA)
  ward,      ///< sqrt(2 |a| |b| / (|a| + |b|)) times that of their means
  centroid,  ///< of their means (UPGMC)
  median,  ///< of their middles: that of a new cluster is midway between those of its parts (WPGMC)
};

/// By the name above; nullopt for any other.
[[nodiscard]] std::optional<LinkageMethod> linkage_method_named(std::string_view name);

/// Linkage by any method. O(n^2) time except for single linkage.
/// - ward: a nearest-neighbour chain over means, without a matrix; 120 bytes per point.
/// - average, weighted: a chain over a matrix of n (n - 1) / 2 entries, and some 50 bytes per
/// point.
///   With float entries each merge rounds its distances to float. Equal to SciPy's result in every
///   bit, ties included: a chain begins at the first cluster and prefers the cluster before in the
///   chain, then the first one; a new cluster takes the place of its later part.
/// - centroid, median: repeatedly the nearest two clusters, the first pair of equally near ones,
///   without a matrix; 120 bytes per point. A merge may be lower than those of its parts;
///   rows are in the order of the merges.
/// Throws: std::invalid_argument as single_linkage() and, naming the bytes needed, if they exceed
/// the memory limit. Sources: F. Murtagh, 1983; W. Day, H. Edelsbrunner, Efficient algorithms for
/// agglomerative hierarchical clustering methods, 1984.
[[nodiscard]] Dendrogram linkage(std::span<const Point3> points, LinkageMethod method,
                                 const LinkageOptions& options = {});

/// Linkage of `count` things of any kind by any method, over a matrix. Ward, centroid and median
/// linkage are meaningful for Euclidean distances only. Throws: std::invalid_argument as
/// complete_linkage() of things.
[[nodiscard]] Dendrogram linkage(std::size_t count, const PairDistance& distance,
                                 LinkageMethod method, const LinkageOptions& options = {});

struct CudaStatus {
  bool available = false;
  std::string device;  ///< name of the GPU, if available
  std::string reason;  ///< if not available: why not, and what to do
};

/// Whether this build has CUDA and this machine a usable device: the current one, which is the
/// first unless the caller or CUDA_VISIBLE_DEVICES chose another.
[[nodiscard]] CudaStatus cuda_available();

/// Complete linkage entirely on the GPU: two counters come back per round and the list of merges at
/// the end. Heights are those of complete_linkage() with the same entries, and so is the dendrogram
/// unless distances are equal. Device memory: n * n / 2 entries, and up to 0.64 of that again when
/// the matrix is rebuilt for the clusters of a round: 1.3 GB for 20 000 points in float. O(n^2)
/// work per halving of the clusters if rounds find many pairs; O(n) rounds in the worst case,
/// points in geometric progression. It differs from the thesis in: all reciprocal nearest
/// neighbours merge at once, and the matrix shrinks with the clusters.
/// Throws: std::invalid_argument for points as complete_linkage() does, or if the device has too
/// little memory, naming the bytes needed; std::runtime_error with the reason if cuda_available()
/// reports none, or if the device fails.
[[nodiscard]] Dendrogram cuda_complete_linkage(std::span<const Point3> points,
                                               MatrixEntry entry = MatrixEntry::float64);

/// Single linkage on the GPU, without a matrix, with the heights of single_linkage(). O(n^2 log n)
/// work in at most log2 n rounds, in double precision; up to 850 bytes of device memory per point.
/// On the CPU single_linkage() is not quadratic. Throws: as cuda_complete_linkage().
[[nodiscard]] Dendrogram cuda_single_linkage(std::span<const Point3> points);

}  // namespace terrace::cluster
