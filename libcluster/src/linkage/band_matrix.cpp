// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/band_matrix.hpp"

#include <cstdlib>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "terrace/cluster/dendrogram.hpp"

namespace terrace::cluster {
namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

}  // namespace

std::uint64_t checked_band_bytes(std::size_t n, std::size_t bytes_per_entry,
                                 std::uint64_t memory_limit) {
  if (n >= kMostDendrogramPoints) {
    throw std::invalid_argument(std::to_string(n) +
                                " points are too many for a matrix of distances: it may have at "
                                "most 2^31 - 1 rows");
  }
  // The product is below 2^31 * 2^30 * 8, so it cannot overflow.
  const std::uint64_t bytes = std::uint64_t{n} * band_width(n) * bytes_per_entry;
  constexpr std::uint64_t kAddressable = std::numeric_limits<std::size_t>::max() / 2;
  if (memory_limit == 0 || memory_limit > kAddressable) memory_limit = kAddressable;
  if (bytes > memory_limit) {
    throw std::invalid_argument("the distances of " + std::to_string(n) + " points would need " +
                                std::to_string(bytes) + " bytes of memory, but the limit is " +
                                std::to_string(memory_limit) +
                                "; use float entries or fewer points, for example one from each "
                                "cluster of a finer clustering");
  }
  return bytes;
}

template <class T>
T* BandMatrix<T>::allocate(std::uint64_t bytes) {
  if (bytes == 0) return nullptr;
  const std::size_t alignment = bytes < kHugePage ? 64 : kHugePage;
  const std::size_t rounded = (static_cast<std::size_t>(bytes) + 63) / 64 * 64;
  // Not aligned_alloc(), which requires a multiple of the alignment and would waste up to two
  // megabytes.
  void* data = nullptr;
  if (posix_memalign(&data, alignment, rounded) != 0) throw std::bad_alloc();
#ifdef __linux__
  // Columns are read as well as rows. With small pages each entry of a column would miss the TLB.
  if (alignment == kHugePage) madvise(data, rounded, MADV_HUGEPAGE);
#endif
  return static_cast<T*>(data);
}

template <class T>
void BandMatrix<T>::release(T* data) {
  std::free(data);
}

template class BandMatrix<float>;
template class BandMatrix<double>;

}  // namespace terrace::cluster
