// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "terrace/cluster/band_matrix.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/point.hpp"

/// Single and complete linkage with the whole dendrogram, on the CPU and on a GPU, of points in
/// space or, with z = 0, in the plane, with Euclidean distances; complete linkage also of things
/// with any other distance.
///
/// Where distances are equal there are several valid dendrograms; which of them comes out depends
/// on the input and its order alone, not on threads or instruction set.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.1, 7.6.

namespace terrace::cluster {

/// The entries of a matrix of distances.
enum class MatrixEntry {
  /// Half the memory. Each distance is rounded to float once, so heights have a relative error
  /// below 1e-7, and clusters whose distances differ by less may merge in the other order.
  /// Distances of points below 1e-18 of the largest coordinate may count as zero.
  float32,
  /// Heights of points are exact to the last bits. Distances of points below 1e-150 of the largest
  /// coordinate may count as zero.
  float64,
};

struct LinkageOptions {
  unsigned threads = 1;  ///< never change the result
  // For complete linkage, which has a matrix:
  MatrixEntry entry = MatrixEntry::float64;
  std::uint64_t memory_limit = 0;  ///< bytes the matrix may take; 0: no limit
  SimdPath path = SimdPath::automatic;
};

/// Single linkage: the distance of two clusters is that of their nearest points. Its dendrogram is
/// the minimum spanning tree with the edges sorted by length. O(n log n) time for points that are
/// not contrived, many equal ones and regular grids included; about 170 bytes of memory a point.
/// Heights are exact to the last bits of a double; distances below 1e-150 of the largest coordinate
/// may count as zero.
/// Source: O. Borůvka, O jistém problému minimálním, 1926, over a kD-tree.
/// Throws: std::invalid_argument, which names the point, if a coordinate is not finite or beyond
/// 1e307 in magnitude.
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        const LinkageOptions& options = {});

/// A pair of points by their numbers.
using PointPair = std::array<std::uint32_t, 2>;

/// Single linkage if only the given pairs are candidates. It is the dendrogram of the points if the
/// pairs contain the edges of a Delaunay triangulation (Shamos, Hoey: Closest-point problems,
/// 1975). Pairs may come twice and in either order. O(e log e) time for e pairs.
/// Throws: std::invalid_argument as above; also if a pair names a point that does not exist, and if
/// the pairs do not connect a point with point 0 (naming it).
[[nodiscard]] Dendrogram single_linkage(std::span<const Point3> points,
                                        std::span<const PointPair> candidates);

/// The edges of the minimum spanning tree itself, each with its length, in no particular order.
[[nodiscard]] std::vector<Link> spanning_tree(std::span<const Point3> points,
                                              const LinkageOptions& options = {});

/// Complete linkage: the distance of two clusters is that of their farthest points. Over half the
/// matrix of distances, n * floor(n / 2) entries, in O(n^2) time: clusters that are each other's
/// nearest will merge, whatever happens elsewhere, so in each round all such pairs merge in one
/// pass over the matrix, which shrinks with the clusters; where a round finds few, a
/// nearest-neighbour chain takes over until a quarter of the clusters is gone. Beside the matrix it
/// takes about 200 bytes a point.
/// Source: F. Murtagh, A survey of recent advances in hierarchical clustering algorithms, 1983.
/// Throws: std::invalid_argument, which names the point, if a coordinate is not finite or beyond
/// 1e307 in magnitude; and, saying how many bytes are needed, if the matrix exceeds the limit.
[[nodiscard]] Dendrogram complete_linkage(std::span<const Point3> points,
                                          const LinkageOptions& options = {});

/// The distance of two things by their numbers i < j. Called once for each pair, and before that
/// about 3 n log n times to find a good order; from several threads at once if there are. An
/// exception that it throws comes out of complete_linkage().
using PairDistance = std::function<double(std::uint32_t i, std::uint32_t j)>;

/// Complete linkage of `count` things of any kind. Throws: std::invalid_argument, naming the pair,
/// if a distance is negative or not finite (in float, if the entries are); and as above for the
/// matrix.
[[nodiscard]] Dendrogram complete_linkage(std::size_t count, const PairDistance& distance,
                                          const LinkageOptions& options = {});

/// Complete linkage of a matrix of distances (band_matrix.hpp), filled. Faster if things that are
/// near have numbers that are near. Its contents are used up; options.entry and memory_limit do not
/// matter. Throws: std::invalid_argument, naming the pair, if an entry is negative or not finite,
/// or the two copies of a pair that is there twice differ.
template <class T>
[[nodiscard]] Dendrogram complete_linkage(BandMatrix<T>&& distances,
                                          const LinkageOptions& options = {});

extern template Dendrogram complete_linkage(BandMatrix<float>&&, const LinkageOptions&);
extern template Dendrogram complete_linkage(BandMatrix<double>&&, const LinkageOptions&);

struct CudaStatus {
  bool available = false;
  std::string device;  ///< the name of the GPU, if available
  std::string reason;  ///< why not, and what to do, if not
};

/// Whether this build has CUDA and this machine a device that it can use: the current one, which is
/// the first unless the caller or CUDA_VISIBLE_DEVICES chose another.
[[nodiscard]] CudaStatus cuda_available();

/// Complete linkage on the GPU, all of it: two counters come back per round and the list of merges
/// at the end. Heights are those of complete_linkage() with the same entries, and so is the
/// dendrogram, unless distances are equal. On the device n * n / 2 entries, and up to 0.64 of that
/// again as the matrix is made anew for the clusters of a round: 1.3 GB for 20 000 points in float.
/// O(n^2) work per halving of the clusters where rounds find many pairs; O(n) rounds in the worst
/// case, of points in geometric progression. Departs from the thesis in: all reciprocal nearest
/// neighbours merge at once, and the matrix shrinks with the clusters.
/// Throws: std::invalid_argument for points as complete_linkage() does, or if the device has too
/// little memory, saying how many bytes are needed; std::runtime_error if cuda_available() says no,
/// with its reason, or if the device fails.
[[nodiscard]] Dendrogram cuda_complete_linkage(std::span<const Point3> points,
                                               MatrixEntry entry = MatrixEntry::float64);

/// Single linkage on the GPU, without a matrix, with the heights of single_linkage(). O(n^2 log n)
/// work in at most log2 n rounds, in double precision; up to 850 bytes of device memory a point. On
/// a CPU single_linkage() is not quadratic. Throws: as cuda_complete_linkage().
[[nodiscard]] Dendrogram cuda_single_linkage(std::span<const Point3> points);

}  // namespace terrace::cluster
