// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/cluster/band_matrix.hpp"

/// What kernels are written with. A kernel is a function object whose body is plain code marked
/// TERRACE_CLUSTER_HOST_DEVICE, and a *device* runs it once for each index, in any order and all at
/// once. On a GPU that is CudaDevice (cuda_device.cuh); tests have one that loops over shuffled
/// indices. A device has
///     allocate<T>(count)           memory that lives as long as the object returned
///     upload, download, clear      between the host and the device; to zero
///     each(count, kernel)          kernel(index)
///     lanes(groups, kernel)        kernel(group, lane, lanes) for every lane of every group,
///     unless
///                                  kernel.skip(group); lanes of a group are next to each other
///     reduce(groups, kernel)       kernel.finish(group, least of kernel.part(group, lane, lanes))
///                                  unless kernel.skip(group)

namespace terrace::cluster::device {

inline constexpr std::uint32_t kNone = UINT32_MAX;

/// Room for what does not grow with the points.
inline constexpr std::size_t kSmallMemory = 65536;

/// Adds to a counter that others add to at the same time.
TERRACE_CLUSTER_HOST_DEVICE inline void add(std::uint32_t* counter, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(counter, value);
#else
  *counter += value;
#endif
}

/// Lowers a value that others lower at the same time.
TERRACE_CLUSTER_HOST_DEVICE inline void lower(std::uint64_t* least, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(reinterpret_cast<unsigned long long*>(least), value);
#else
  *least = value < *least ? value : *least;
#endif
}

/// A neighbour: `value` away. No neighbour is kNone, whose value does not count.
template <class Entry>
struct Best {
  Entry value = 0;
  std::uint32_t index = kNone;
};

/// The nearer of two, of equals the one of lower index.
template <class Entry>
TERRACE_CLUSTER_HOST_DEVICE Best<Entry> nearer(const Best<Entry>& a, const Best<Entry>& b) {
  if (a.index == kNone) return b;
  if (b.index == kNone) return a;
  return a.value < b.value || (a.value == b.value && a.index < b.index) ? a : b;
}

/// What comes back: cluster of point i and cluster of point j became one in that round.
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
