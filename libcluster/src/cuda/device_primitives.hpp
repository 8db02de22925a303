// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/cluster/band_matrix.hpp"

/// The vocabulary of kernels. A kernel is a function object whose body is plain code marked
/// TERRACE_CLUSTER_HOST_DEVICE. A *device* runs it once for each index, in any order and
/// concurrently. On a GPU the device is a CudaDevice (device.cuh). Tests have one that loops
/// over shuffled indices. A device has
///     allocate<T>(count)           memory that lives as long as the returned object
///     upload, download, clear      copy to the device, copy to the host, set to zero
///     each(count, kernel)          kernel(index)
///     lanes(groups, kernel)        kernel(group, lane, lanes) for every lane of every group
///                                  unless kernel.skip(group); lanes of a group are adjacent
///     reduce(groups, kernel)       kernel.finish(group, least of kernel.part(group, lane, lanes))
///                                  unless kernel.skip(group)

namespace terrace::cluster::device {

inline constexpr std::uint32_t kNone = UINT32_MAX;

/// Memory, in bytes, for data that does not grow with the points.
inline constexpr std::size_t kSmallMemory = 65536;

/// Adds to a counter atomically.
TERRACE_CLUSTER_HOST_DEVICE inline void add(std::uint32_t* counter, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(counter, value);
#else
  *counter += value;
#endif
}

/// Lowers a value atomically.
TERRACE_CLUSTER_HOST_DEVICE inline void lower(std::uint64_t* least, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(reinterpret_cast<unsigned long long*>(least), value);
#else
  *least = value < *least ? value : *least;
#endif
}

/// A neighbour at distance `value`. If the index is kNone there is no neighbour and the value is
/// meaningless.
template <class Entry>
struct Best {
  Entry value = 0;
  std::uint32_t index = kNone;
};

/// Returns the nearer of two, on ties the one of lower index.
template <class Entry>
TERRACE_CLUSTER_HOST_DEVICE Best<Entry> nearer(const Best<Entry>& a, const Best<Entry>& b) {
  if (a.index == kNone) return b;
  if (b.index == kNone) return a;
  return a.value < b.value || (a.value == b.value && a.index < b.index) ? a : b;
}

/// One merge: the clusters of point i and of point j merged in that round.
struct RoundLink {
  std::uint32_t i, j;
  double square;
  std::uint32_t round;
};

TERRACE_CLUSTER_HOST_DEVICE inline double squared(const double* x, const double* y, const double* z,
                                                  std::size_t i, std::size_t j) {
  const double dx = x[i] - x[j];
  const double dy = y[i] - y[j];
  const double dz = z[i] - z[j];
  return dx * dx + dy * dy + dz * dz;
}

}  // namespace terrace::cluster::device
