// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "terrace/cluster/complete_linkage.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/point.hpp"

/// Single and complete linkage on a GPU, by CUDA. The header and the functions are there in every
/// build; cuda_available() tells whether they work.
///
/// Everything is done on the device: distances, nearest neighbours, merging, updating. Two counters
/// come back per round and the list of merges at the end. Heights are those that complete_linkage()
/// with the same entries and single_linkage() give, and so is the dendrogram, unless distances are
/// equal: then there are several valid ones. The result depends on the input alone.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.6. Departs from it in:
/// all reciprocal nearest neighbours merge at once, the matrix shrinks with the clusters, and
/// single linkage needs no matrix (src/device_single.hpp).

namespace terrace::cluster {

struct CudaStatus {
  bool available = false;
  std::string device;  ///< the name of the GPU, if available
  std::string reason;  ///< why not, and what to do, if not
};

/// Whether this build has CUDA and this machine a device that it can use: the current one, which is
/// the first unless the caller or CUDA_VISIBLE_DEVICES chose another.
[[nodiscard]] CudaStatus cuda_available();

struct CudaLinkageOptions {
  MatrixEntry entry = MatrixEntry::float64;  ///< of complete linkage
};

/// Complete linkage of points in space or, with z = 0, in the plane, with Euclidean distances.
/// On the device n * n / 2 entries (band_index.hpp), and up to 0.64 of that again as the matrix is
/// made anew for the clusters of a round: 1.3 GB for 20 000 points in float. O(n^2) work per
/// halving of the clusters where rounds find many pairs; O(n) rounds in the worst case, of points
/// in geometric progression. Throws std::invalid_argument for points as complete_linkage() does, or
/// if the device has too little memory, saying how many bytes are needed; std::runtime_error if
/// cuda_available() says no, with its reason, or if the device fails.
[[nodiscard]] Dendrogram cuda_complete_linkage(std::span<const Point3> points,
                                               const CudaLinkageOptions& options = {});

/// Single linkage of the same. O(n^2 log n) work in at most log2 n rounds, in double precision;
/// up to 850 bytes of device memory a point. On a CPU single_linkage() is not quadratic.
/// Throws as cuda_complete_linkage().
[[nodiscard]] Dendrogram cuda_single_linkage(std::span<const Point3> points);

}  // namespace terrace::cluster
