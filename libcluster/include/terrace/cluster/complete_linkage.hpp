// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "terrace/cluster/band_matrix.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/point.hpp"

/// Complete linkage: the distance of two clusters is that of their farthest points.
///
/// Over the band-shaped half matrix of distances, n * floor(n / 2) entries (band_matrix.hpp), in
/// O(n^2) time. Complete linkage is reducible: clusters that are each other's nearest will merge,
/// whatever happens elsewhere. So in each round all such pairs merge in one pass over the matrix,
/// which shrinks with the clusters; where a round finds few, a nearest-neighbour chain takes over
/// until a quarter of the clusters is gone. Beside the matrix it takes about 200 bytes a point.
/// Sources: J. Skála, Algorithms for manipulating large geometric data, 4.2.1, 7.6; F. Murtagh,
/// A survey of recent advances in hierarchical clustering algorithms, 1983.
///
/// Where distances are equal there are several valid dendrograms; which of them comes out depends
/// on the input alone, not on threads or instruction set.

namespace terrace::cluster {

/// The entries of the matrix.
enum class MatrixEntry {
  /// Half the memory. Each distance is rounded to float once, so heights have a relative error
  /// below 1e-7, and clusters whose distances differ by less may merge in the other order. Of
  /// points: distances below 1e-18 of the largest coordinate may count as zero.
  float32,
  /// Heights of points are exact to the last bits. Of points: distances below 1e-150 of the largest
  /// coordinate may count as zero.
  float64,
};

struct CompleteLinkageOptions {
  unsigned threads = 1;  ///< never change the result
  MatrixEntry entry = MatrixEntry::float64;
  std::uint64_t memory_limit = 0;  ///< bytes the matrix may take; 0: no limit
  SimdPath path = SimdPath::automatic;
};

/// Points in space or, with z = 0, in the plane, and Euclidean distances.
/// Throws std::invalid_argument, which names the point, if a coordinate is not finite or beyond
/// 1e307 in magnitude; and, saying how many bytes are needed, if the matrix exceeds the limit.
[[nodiscard]] Dendrogram complete_linkage(std::span<const Point3> points,
                                          const CompleteLinkageOptions& options = {});

/// The distance of two things by their numbers i < j. Called once for each pair, and before that
/// about 3 n log n times to find a good order; from several threads at once if there are. An
/// exception of it comes out of complete_linkage().
using PairDistance = std::function<double(std::uint32_t i, std::uint32_t j)>;

/// `count` things of any kind. Throws std::invalid_argument, naming the pair, if a distance is
/// negative or not finite (in float, if the entries are); and as above for the matrix.
[[nodiscard]] Dendrogram complete_linkage(std::size_t count, const PairDistance& distance,
                                          const CompleteLinkageOptions& options = {});

/// A matrix of distances, filled. Faster if things that are near have numbers that are near. Its
/// contents are used up; options.entry and memory_limit do not matter. Throws
/// std::invalid_argument, naming the pair, if an entry is negative or not finite, or the two copies
/// of a pair that is there twice differ.
template <class T>
[[nodiscard]] Dendrogram complete_linkage(BandMatrix<T>&& distances,
                                          const CompleteLinkageOptions& options = {});

extern template Dendrogram complete_linkage(BandMatrix<float>&&, const CompleteLinkageOptions&);
extern template Dendrogram complete_linkage(BandMatrix<double>&&, const CompleteLinkageOptions&);

}  // namespace terrace::cluster
